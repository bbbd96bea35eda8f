#pragma once

#include <algorithm>
#include <limits>

#include "smooth/base/convergence.hpp"
#include "smooth/energy/mesh_energy.hpp"
#include "smooth/optimize/optimize_visit.hpp"

namespace meshsmooth::detail {

/// Decides after every sweep of a phase whether the phase continues, and the job. A phase may be
/// run in parts: `limit` sets how many sweeps the next part has.
class PhaseMonitor {
 public:
  static constexpr int kNoLimit = std::numeric_limits<int>::max();

  PhaseMonitor(ConvergenceMonitor& job, const OptimizePhase& phase, PhaseEnd end, double target)
      : job_(job), phase_(phase), end_(end), target_(target) {}

  /// The part that begins has at most this many sweeps.
  void limit(int sweeps) { part_end_ = sweeps < kNoLimit - sweeps_ ? sweeps_ + sweeps : kNoLimit; }

  /// True when the sweep just done was the part's last. `energy` may be null unless
  /// `needs_energy`.
  [[nodiscard]] bool done(const OptimizeStats& stats, const MeshEnergy* energy) {
    return ended_by(stats, energy) || interrupted();
  }

  /// `done` by the sweeps alone.
  [[nodiscard]] bool ended_by(const OptimizeStats& stats, const MeshEnergy* energy) {
    job_.record(stats.moves);
    gain_before_ = last_.gain;
    last_ = stats;
    ++sweeps_;
    if (job_.keeps_history()) job_.record_energy(mean_energy(*energy, phase_.power), energy->worst);
    if (target_ > 0 && energy->worst >= target_) return end_job(StopReason::target_reached);
    ended_ = end_.after(stats, gain_before_);
    if (ended_) return true;
    if (job_.sweeps_left() == 0) return end_job(StopReason::iteration_limit);
    ended_ =
        stats.tangled > 0 && stuck() && (end_.when_untangled || end_.settled(stats, gain_before_));
    return ended_ || sweeps_ == part_end_;
  }

  [[nodiscard]] bool interrupted() {
    if (job_.interrupted()) job_ended_ = true;
    return job_ended_;
  }

  /// Whether the mesh must be measured after every sweep.
  [[nodiscard]] bool needs_energy() const { return job_.keeps_history() || target_ > 0; }

  /// How many sweeps a backend may run in one batch if it applies `end()` itself after each: no
  /// other rule ends the part earlier.
  [[nodiscard]] int sweeps_ahead() const {
    if (needs_energy()) return 1;
    const int left = std::min(job_.sweeps_left(), part_end_ - sweeps_);
    const bool patient = sweeps_ > 0 && last_.tangled == 0;
    return patient ? left : std::clamp(lowest_at_ + kPatience - sweeps_, 1, left);
  }
  [[nodiscard]] const PhaseEnd& end() const { return end_; }

  /// After a part: whether the phase is over, by `end()` or because tangled balls do not improve.
  [[nodiscard]] bool ended() const { return ended_ || job_ended_; }
  /// After a part: whether the job is over.
  [[nodiscard]] bool job_ended() const { return job_ended_; }
  [[nodiscard]] const OptimizeStats& last() const { return last_; }
  /// What further sweeps would gain, were their gains to go on falling as the last two.
  [[nodiscard]] double remaining_gain() const {
    return last_.tangled > 0 ? HUGE_VAL
           : last_.gain == 0 ? 0
                             : PhaseEnd::remaining_gain(last_.gain, gain_before_);
  }

 private:
  static constexpr int kPatience = 10;

  bool end_job(StopReason reason) { return job_ended_ = job_.end(reason); }

  /// The tangled balls have become neither fewer nor less deep for many sweeps. The number alone
  /// rises at first where an inversion must spread before it can go.
  bool stuck() {
    if (last_.tangled < fewest_ || last_.depth < 0.999 * least_depth_) lowest_at_ = sweeps_;
    fewest_ = std::min(fewest_, last_.tangled);
    least_depth_ = std::min(least_depth_, last_.depth);
    return sweeps_ - lowest_at_ >= kPatience;
  }

  ConvergenceMonitor& job_;
  const OptimizePhase& phase_;
  PhaseEnd end_;
  double target_;
  OptimizeStats last_;
  double gain_before_ = 0;
  int sweeps_ = 0;
  int part_end_ = kNoLimit;
  int lowest_at_ = 0;
  std::int64_t fewest_ = std::numeric_limits<std::int64_t>::max();
  double least_depth_ = std::numeric_limits<double>::infinity();
  bool ended_ = false;
  bool job_ended_ = false;
};

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <limits>

#include "smooth/rules/optimize_visit.hpp"
#include "smooth/steps/convergence.hpp"
#include "smooth/steps/mesh_energy.hpp"

namespace meshsmooth::detail {

/// Decides after every sweep of a phase whether the phase continues, and the job.
class PhaseMonitor {
 public:
  PhaseMonitor(ConvergenceMonitor& job, const OptimizePhase& phase, PhaseEnd end, double target)
      : job_(job), phase_(phase), end_(end), target_(target) {}

  /// True when the sweep just done was the phase's last. `energy` may be null unless
  /// `needs_energy`.
  [[nodiscard]] bool done(const OptimizeStats& stats, const MeshEnergy* energy) {
    return ended_by(stats, energy) || interrupted();
  }

  /// `done` by the sweeps alone.
  [[nodiscard]] bool ended_by(const OptimizeStats& stats, const MeshEnergy* energy) {
    job_.record(stats.moves);
    last_ = stats;
    ++sweeps_;
    if (job_.options().history)
      job_.record_energy(mean_energy(*energy, phase_.power), energy->worst);
    if (target_ > 0 && energy->worst >= target_) return end_job(StopReason::target_reached);
    if (end_.after(stats)) return true;
    if (job_.sweeps_left() == 0) return end_job(StopReason::iteration_limit);
    return end_.when_untangled && stuck();
  }

  [[nodiscard]] bool interrupted() {
    if (job_.interrupted()) job_ended_ = true;
    return job_ended_;
  }

  /// Whether the mesh must be measured after every sweep.
  [[nodiscard]] bool needs_energy() const { return job_.options().history || target_ > 0; }

  /// How many sweeps a backend may run in one batch if it applies `end()` itself after each: no
  /// other rule ends the phase earlier.
  [[nodiscard]] int sweeps_ahead() const {
    if (needs_energy()) return 1;
    const int left = job_.sweeps_left();
    return end_.when_untangled ? std::min(left, lowest_at_ + kPatience - sweeps_) : left;
  }
  [[nodiscard]] const PhaseEnd& end() const { return end_; }

  /// After the phase: whether the job is over.
  [[nodiscard]] bool job_ended() const { return job_ended_; }
  [[nodiscard]] const OptimizeStats& last() const { return last_; }

 private:
  static constexpr int kPatience = 10;

  bool end_job(StopReason reason) { return job_ended_ = job_.end(reason); }

  /// The tangled balls have not become fewer for many sweeps.
  bool stuck() {
    if (last_.tangled < lowest_) {
      lowest_ = last_.tangled;
      lowest_at_ = sweeps_;
    }
    return sweeps_ - lowest_at_ >= kPatience;
  }

  ConvergenceMonitor& job_;
  const OptimizePhase& phase_;
  PhaseEnd end_;
  double target_;
  OptimizeStats last_;
  int sweeps_ = 0;
  int lowest_at_ = 0;
  std::int64_t lowest_ = std::numeric_limits<std::int64_t>::max();
  bool job_ended_ = false;
};

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"
#include "smooth/base/sweep_stats.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Decides after every sweep whether the job continues, and records its history.
class ConvergenceMonitor {
 public:
  /// Sweeps without a new minimum of the moves after which the job has stagnated.
  static constexpr int kPatience = 50;

  ConvergenceMonitor(const JobPlan& plan, const JobControl& control, double diagonal,
                     std::size_t free_count)
      : plan_(plan), control_(control), free_count_(free_count) {
    const SmoothOptions& options = plan.options;
    state_.bounding_box_diagonal = diagonal;
    state_.tolerance = displacement_tolerance(options, diagonal);
    if (options.compute_budget) budget_end_ = end_of(*options.compute_budget);
  }

  /// Before any sweep: true when there is nothing to do.
  [[nodiscard]] bool done_at_once() {
    if (plan_.iteration_limit == 0) return end(StopReason::iteration_limit);
    if (free_count_ == 0) return end(StopReason::converged);
    return interrupted();
  }

  /// True when the sweep just done was the last.
  [[nodiscard]] bool done(const SweepStats& stats) { return ended_by(stats) || interrupted(); }

  /// `done` by the sweeps alone, whenever it is called.
  [[nodiscard]] bool ended_by(const SweepStats& stats) {
    record(stats);
    if (stats.moved == 0 && stats.held > 0) return end(StopReason::stagnated, EndRule::all_held);
    if (stats.moved == 0) return end(StopReason::converged, EndRule::at_rest);
    if (state_.last_max_displacement < state_.tolerance) {
      return end(StopReason::converged, EndRule::small_moves);
    }
    if (sweeps_left() == 0) return end(StopReason::iteration_limit);
    if (stagnated()) return end(StopReason::stagnated, EndRule::no_progress);
    return false;
  }

  /// Adds a sweep to the history and reports progress.
  void record(const SweepStats& stats) {
    ++state_.iteration_count;
    state_.last_max_displacement = std::sqrt(stats.max_squared);
    state_.last_rms_displacement = std::sqrt(stats.sum_squared / static_cast<double>(free_count_));
    state_.held_node_count = stats.held;
    if (keeps_history()) {
      state_.max_displacements.push_back(state_.last_max_displacement);
      state_.rms_displacements.push_back(state_.last_rms_displacement);
      state_.moved_node_counts.push_back(stats.moved);
    }
    if (control_.on_progress) {
      control_.on_progress({Stage::iterate, state_.iteration_count, state_.last_max_displacement,
                            state_.last_rms_displacement});
    }
    if (!std::isfinite(stats.sum_squared)) {
      throw InvalidMesh("NON_FINITE_RESULT",
                        "sweep " + std::to_string(state_.iteration_count) +
                            ": positions left the range of the coordinate type; scale the mesh "
                            "or send float64");
    }
  }

  /// Adds the mesh after the last sweep to the history.
  void record_energy(double energy, double worst_mean_ratio) {
    state_.energies.push_back(energy);
    state_.worst_mean_ratios.push_back(worst_mean_ratio);
  }

  /// `done` by external causes: the clock and the caller.
  [[nodiscard]] bool interrupted() {
    if (control_.finish_early != nullptr && control_.finish_early->load()) {
      return end(StopReason::cancelled_with_result);
    }
    if (budget_end_ && Clock::now() >= *budget_end_) return end(StopReason::compute_budget);
    return false;
  }

  /// How many sweeps a backend may run in one batch if it ends by the moves (tolerance, no
  /// move) itself: no other rule ends the job earlier.
  [[nodiscard]] int sweeps_ahead() const {
    return std::min(sweeps_left(), lowest_at_ + kPatience - state_.iteration_count);
  }
  [[nodiscard]] int sweeps_left() const { return plan_.iteration_limit - state_.iteration_count; }
  [[nodiscard]] double tolerance() const { return state_.tolerance; }

  /// A `Tolerance` or a `MovementLimit` in the mesh's unit; relative ones are shares of the
  /// bounding box's diagonal.
  template <class Length>
  [[nodiscard]] double in_mesh_unit(const Length& length) const {
    return meshsmooth::in_mesh_unit(length, state_.bounding_box_diagonal);
  }

  [[nodiscard]] const JobPlan& plan() const { return plan_; }
  [[nodiscard]] bool keeps_history() const { return plan_.options.history; }
  [[nodiscard]] std::size_t free_count() const { return free_count_; }

  /// Ends the job; true.
  bool end(StopReason reason, EndRule rule = EndRule::none) {
    reason_ = reason;
    state_.end_rule = rule;
    return true;
  }
  /// Sum over the free nodes of what further sweeps of `Optimize` would gain.
  void record_remaining(double gain) {
    state_.remaining_gain.reset();
    if (std::isfinite(gain)) state_.remaining_gain = gain / static_cast<double>(free_count_);
  }
  void record_poor(const PoorElements& poor) { poor_ = poor; }
  [[nodiscard]] const std::optional<PoorElements>& poor() const { return poor_; }
  [[nodiscard]] StopReason reason() const { return reason_; }
  [[nodiscard]] Convergence take() { return std::move(state_); }

 private:
  using Clock = std::chrono::steady_clock;

  /// A budget of centuries must not end in the past.
  [[nodiscard]] static Clock::time_point end_of(std::chrono::nanoseconds budget) {
    const auto now = Clock::now();
    return budget < Clock::time_point::max() - now ? now + budget : Clock::time_point::max();
  }

  /// The root mean square of the moves has reached no new minimum for many sweeps: nodes only
  /// oscillate (the end of a method under the guard, or of the precision).
  bool stagnated() {
    if (state_.last_rms_displacement < 0.99 * lowest_) {
      lowest_ = state_.last_rms_displacement;
      lowest_at_ = state_.iteration_count;
    }
    return state_.iteration_count - lowest_at_ >= kPatience;
  }

  const JobPlan& plan_;
  const JobControl& control_;
  std::size_t free_count_;
  std::optional<Clock::time_point> budget_end_;
  Convergence state_;
  StopReason reason_ = StopReason::converged;
  std::optional<PoorElements> poor_;
  double lowest_ = HUGE_VAL;
  int lowest_at_ = 0;
};

}  // namespace meshsmooth::detail

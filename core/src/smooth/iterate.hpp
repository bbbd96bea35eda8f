#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <type_traits>
#include <utility>

#include "meshsmooth/smoother.hpp"
#include "smooth/sweeps.hpp"

namespace meshsmooth::detail {

[[nodiscard]] inline Form resolve_form(const SmoothOptions& options) {
  if (options.form != Form::automatic) return options.form;
  return std::holds_alternative<SmartLaplacian>(options.method) ? Form::gauss_seidel : Form::jacobi;
}

[[nodiscard]] inline Acceptance acceptance_of(const SmoothOptions& options) {
  return {options.guard, std::holds_alternative<SmartLaplacian>(options.method)};
}

/// Whether a job needs the balls beyond finding rings and boundary.
[[nodiscard]] inline bool needs_balls(const SmoothOptions& options) {
  const auto* laplacian = std::get_if<Laplacian>(&options.method);
  return acceptance_of(options).active() || resolve_form(options) == Form::gauss_seidel ||
         (laplacian != nullptr && laplacian->weighting == Weighting::ball_volume);
}

/// Decides after every sweep whether the job goes on, and keeps its history.
class ConvergenceWatch {
 public:
  ConvergenceWatch(const SmoothOptions& options, const JobControl& control, double diagonal,
                   std::size_t free_count)
      : options_(options), control_(control), free_count_(free_count) {
    state_.bounding_box_diagonal = diagonal;
    state_.tolerance = options.tolerance.value * (options.tolerance.relative ? diagonal : 1.0);
    if (options.compute_budget) budget_end_ = Clock::now() + *options.compute_budget;
  }

  /// Before any sweep: true when there is nothing to do.
  [[nodiscard]] bool done_at_once() {
    if (options_.max_iterations == 0) return end(StopReason::iteration_limit);
    if (free_count_ == 0) return end(StopReason::converged);
    return interrupted();
  }

  /// True when the sweep just done was the last.
  [[nodiscard]] bool done(const SweepStats& stats) { return ended_by(stats) || interrupted(); }

  /// What `done` says from the sweeps alone, whenever it is asked.
  [[nodiscard]] bool ended_by(const SweepStats& stats) {
    ++state_.iteration_count;
    state_.last_max_displacement = std::sqrt(stats.max_squared);
    state_.last_rms_displacement = std::sqrt(stats.sum_squared / static_cast<double>(free_count_));
    state_.held_node_count = stats.held;
    if (options_.history) {
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
    if (stats.moved == 0 && stats.held > 0) return end(StopReason::stagnated);
    if (state_.last_max_displacement < state_.tolerance || stats.moved == 0) {
      return end(StopReason::converged);
    }
    if (state_.iteration_count >= options_.max_iterations) return end(StopReason::iteration_limit);
    if (stagnated()) return end(StopReason::stagnated);
    return false;
  }

  /// What `done` says from outside: the clock and the caller.
  [[nodiscard]] bool interrupted() {
    if (control_.finish_early != nullptr && control_.finish_early->load()) {
      return end(StopReason::cancelled_with_result);
    }
    if (budget_end_ && Clock::now() >= *budget_end_) return end(StopReason::compute_budget);
    return false;
  }

  /// How many sweeps may be done at one go, if those that end by their moves
  /// (tolerance, no move) stop by themselves: no other rule ends one before.
  [[nodiscard]] int sweeps_ahead() const {
    return std::min(options_.max_iterations - state_.iteration_count,
                    lowest_at_ + kPatience - state_.iteration_count);
  }
  [[nodiscard]] double tolerance() const { return state_.tolerance; }

  [[nodiscard]] StopReason reason() const { return reason_; }
  [[nodiscard]] Convergence take() { return std::move(state_); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr int kPatience = 50;

  bool end(StopReason reason) {
    reason_ = reason;
    return true;
  }

  /// The root mean square of the moves has found no new low for many sweeps:
  /// they only go to and fro (the end of a method under the guard, or of the
  /// precision).
  bool stagnated() {
    if (state_.last_rms_displacement < 0.99 * lowest_) {
      lowest_ = state_.last_rms_displacement;
      lowest_at_ = state_.iteration_count;
    }
    return state_.iteration_count - lowest_at_ >= kPatience;
  }

  const SmoothOptions& options_;
  const JobControl& control_;
  std::size_t free_count_;
  std::optional<Clock::time_point> budget_end_;
  Convergence state_;
  StopReason reason_ = StopReason::converged;
  double lowest_ = HUGE_VAL;
  int lowest_at_ = 0;
};

/// Runs one sweep of a Laplacian step in the form that was asked for. Holds the
/// second array that forms A and racing need; `current()` is where the
/// positions are.
template <Executor E, class Real>
class Sweeper {
 public:
  Sweeper(E& executor, const Surroundings& around, const Colouring<E>& colouring, Form form,
          Acceptance acceptance, Vec3<Real>* positions)
      : executor_(executor),
        around_(around),
        colouring_(colouring),
        form_(form),
        acceptance_(acceptance),
        current_(positions) {}

  template <class Mean>
  SweepStats step(const Mean& mean, double factor) {
    const auto f = static_cast<Real>(factor);
    if (form_ == Form::gauss_seidel) {
      return sweep_gauss_seidel(executor_, around_, colouring_, mean, f, acceptance_, current_);
    }
    if (form_ == Form::racing) {
      if (acceptance_.active()) need_spare();
      return sweep_racing(executor_, around_, mean, f, acceptance_, spare_, current_);
    }
    need_spare();
    const SweepStats stats =
        sweep_jacobi(executor_, around_, mean, f, acceptance_, current_, spare_);
    std::swap(current_, spare_);
    return stats;
  }

  SweepStats step_hc(const HcLaplacian& hc, const Vec3<Real>* original, Vec3<Real>* differences) {
    need_spare();
    const SweepStats stats =
        sweep_hc(executor_, around_, static_cast<Real>(hc.alpha), static_cast<Real>(hc.beta),
                 acceptance_, original, current_, spare_, differences);
    std::swap(current_, spare_);
    return stats;
  }

  /// `copy(from, to)` over all nodes.
  void copy(const Vec3<Real>* from, Vec3<Real>* to) {
    executor_.for_each(around_.node_count,
                       [=] MESHSMOOTH_HD(std::size_t node) { to[node] = from[node]; });
  }

  [[nodiscard]] Vec3<Real>* current() { return current_; }

  [[nodiscard]] const Surroundings& around() const { return around_; }
  [[nodiscard]] const Colouring<E>& colouring() const { return colouring_; }
  [[nodiscard]] Form form() const { return form_; }
  [[nodiscard]] Acceptance acceptance() const { return acceptance_; }

 private:
  void need_spare() {
    if (spare_ != nullptr) return;
    other_ = executor_.template allocate<Vec3<Real>>(around_.node_count);
    spare_ = other_.data();
    copy(current_, spare_);
  }

  E& executor_;
  const Surroundings& around_;
  const Colouring<E>& colouring_;
  Form form_;
  Acceptance acceptance_;
  Vec3<Real>* current_;
  Vec3<Real>* spare_ = nullptr;
  typename E::template Buffer<Vec3<Real>> other_;
};

/// Sweeps of one step each until the watch says that it is done.
template <Executor E, class Real, class Mean>
void run_sweeps_one_by_one(Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                           ConvergenceWatch& watch) {
  while (!watch.done(sweeper.step(mean, factor))) {
  }
}
template <Executor E, class Real, class Mean>
void run_sweeps(E&, Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                ConvergenceWatch& watch) {
  run_sweeps_one_by_one(sweeper, mean, factor, watch);
}

/// Calls `body(mean)` with the rule of a weighting.
template <class Body>
void with_mean(Weighting weighting, const Body& body) {
  switch (weighting) {
    case Weighting::uniform:
      return body(UniformMean{});
    case Weighting::inverse_edge_length:
      return body(EdgeLengthMean<-1>{});
    case Weighting::edge_length:
      return body(EdgeLengthMean<1>{});
    case Weighting::ball_volume:
      return body(BallVolumeMean{});
  }
}

/// Step 3: sweeps until the watch says that it is done.
///
/// takes  `positions` in internal order
/// gives  the smoothed positions in `positions`
/// cost   O(sweeps * entries); one or two more arrays of positions
template <Executor E, class Real>
void iterate(E& executor, const Surroundings& around, const Colouring<E>& colouring,
             const SmoothOptions& options, ConvergenceWatch& watch, Vec3<Real>* positions) {
  if (watch.done_at_once()) return;
  Sweeper<E, Real> sweeper(executor, around, colouring, resolve_form(options),
                           acceptance_of(options), positions);
  const auto allocate = [&] { return executor.template allocate<Vec3<Real>>(around.node_count); };

  const auto run = [&](const auto& method) {
    using M = std::decay_t<decltype(method)>;
    if constexpr (std::is_same_v<M, Taubin>) {
      auto start = allocate();
      SweepStats stats;
      do {
        sweeper.copy(sweeper.current(), start.data());
        const std::int64_t held = sweeper.step(UniformMean{}, method.lambda).held +
                                  sweeper.step(UniformMean{}, method.mu).held;
        stats = measure_moves(executor, around.node_count, start.data(), sweeper.current());
        stats.held = held;
      } while (!watch.done(stats));
    } else if constexpr (std::is_same_v<M, HcLaplacian>) {
      auto original = allocate();
      auto differences = allocate();
      sweeper.copy(sweeper.current(), original.data());
      while (!watch.done(sweeper.step_hc(method, original.data(), differences.data()))) {
      }
    } else {
      with_mean(method.weighting, [&](const auto& mean) {
        run_sweeps(executor, sweeper, mean, method.relaxation, watch);
      });
    }
  };
  std::visit(run, options.method);
  if (sweeper.current() != positions) sweeper.copy(sweeper.current(), positions);
}

}  // namespace meshsmooth::detail

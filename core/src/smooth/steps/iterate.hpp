#pragma once

#include <type_traits>
#include <utility>

#include "smooth/steps/convergence.hpp"
#include "smooth/steps/optimize.hpp"

namespace meshsmooth::detail {

[[nodiscard]] inline Form resolve_form(const SmoothOptions& options) {
  if (options.form != Form::automatic) return options.form;
  return forms_of(options.method).front();
}

[[nodiscard]] inline Acceptance acceptance_of(const SmoothOptions& options) {
  return {options.guard, std::holds_alternative<SmartLaplacian>(options.method),
          options.boundary == BoundaryPolicy::slide};
}

/// Whether a job needs the balls beyond finding rings and boundary.
[[nodiscard]] inline bool needs_balls(const SmoothOptions& options) {
  const auto* laplacian = std::get_if<Laplacian>(&options.method);
  return acceptance_of(options).active() || resolve_form(options) == Form::gauss_seidel ||
         (laplacian != nullptr && laplacian->weighting == Weighting::ball_volume);
}

/// Runs one sweep of a Laplacian step in the form that was asked for. Holds the
/// second array that forms A and racing need; `current()` is where the
/// positions are.
template <Executor E, class Real>
class Sweeper {
 public:
  Sweeper(E& executor, const Surroundings& around, const Colouring<E>& colouring, Form form,
          Acceptance acceptance, DisplacementLimit<Real> displacement_limit, Vec3<Real>* positions)
      : executor_(executor),
        around_(around),
        colouring_(colouring),
        form_(form),
        acceptance_(acceptance),
        displacement_limit_(displacement_limit),
        current_(positions) {}

  template <class Mean>
  SweepStats step(const Mean& mean, double factor) {
    const auto f = static_cast<Real>(factor);
    if (form_ == Form::gauss_seidel) {
      return sweep_gauss_seidel(executor_, around_, colouring_, mean, f, acceptance_, current_,
                                displacement_limit_);
    }
    if (form_ == Form::asynchronous) {
      if (acceptance_.active()) need_spare();
      return sweep_asynchronous(executor_, around_, mean, f, acceptance_, spare_, current_,
                                displacement_limit_);
    }
    need_spare();
    const SweepStats stats = sweep_jacobi(executor_, around_, mean, f, acceptance_, current_,
                                          spare_, displacement_limit_);
    std::swap(current_, spare_);
    return stats;
  }

  SweepStats step_hc(const HcLaplacian& hc, const Vec3<Real>* original, Vec3<Real>* differences) {
    need_spare();
    const SweepStats stats =
        sweep_hc(executor_, around_, static_cast<Real>(hc.alpha), static_cast<Real>(hc.beta),
                 acceptance_, original, current_, spare_, differences, displacement_limit_);
    std::swap(current_, spare_);
    return stats;
  }

  /// Tells the watch of the sweep just done, for a history also what the mesh is energy; true
  /// when it was the last.
  bool done(const SweepStats& stats, ConvergenceMonitor& watch) {
    if (watch.options().history) {
      const int power = power_of(Goal::balanced);
      const MeshEnergy energy = measure_energy(executor_, around_, current_, power);
      watch.record_energy(mean_energy(energy, power), energy.worst);
    }
    return watch.done(stats);
  }

  void copy(const Vec3<Real>* from, Vec3<Real>* to) {
    copy_positions(executor_, around_.node_count, from, to);
  }

  [[nodiscard]] Vec3<Real>* current() { return current_; }

  [[nodiscard]] const Surroundings& around() const { return around_; }
  [[nodiscard]] const Colouring<E>& colouring() const { return colouring_; }
  [[nodiscard]] Form form() const { return form_; }
  [[nodiscard]] Acceptance acceptance() const { return acceptance_; }
  /// Whether some nodes may not go everywhere.
  [[nodiscard]] bool limited() const {
    return displacement_limit_.home != nullptr || around_.sliding.any();
  }

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
  DisplacementLimit<Real> displacement_limit_;
  Vec3<Real>* current_;
  Vec3<Real>* spare_ = nullptr;
  typename E::template Buffer<Vec3<Real>> other_;
};

/// Sweeps of one step each until the watch says that it is done.
template <Executor E, class Real, class Mean>
void run_sweeps_one_by_one(Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                           ConvergenceMonitor& watch) {
  while (!sweeper.done(sweeper.step(mean, factor), watch)) {
  }
}
template <Executor E, class Real, class Mean>
void run_sweeps(E&, Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                ConvergenceMonitor& watch) {
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
/// cost   O(sweeps * entries); one or two more arrays of positions, one more for a
///        movement limit
template <Executor E, class Real>
void iterate(E& executor, const Surroundings& around, const Colouring<E>& colouring,
             const SmoothOptions& options, ConvergenceMonitor& watch,
             const CallerPositions<Real>& given, Vec3<Real>* positions) {
  if (watch.done_at_once()) return;
  const auto allocate = [&] { return executor.template allocate<Vec3<Real>>(around.node_count); };
  typename E::template Buffer<Vec3<Real>> home;
  DisplacementLimit<Real> displacement_limit;
  if (options.movement_limit) {
    home = allocate();
    copy_positions(executor, around.node_count, positions, home.data());
    displacement_limit = {home.data(), watch.in_mesh_unit(*options.movement_limit)};
  }
  if (const auto* method = std::get_if<Optimize>(&options.method)) {
    return optimize(executor, around, colouring, *method, displacement_limit, watch, given,
                    positions);
  }
  Sweeper<E, Real> sweeper(executor, around, colouring, resolve_form(options),
                           acceptance_of(options), displacement_limit, positions);

  const auto run = [&](const auto& method) {
    using M = std::decay_t<decltype(method)>;
    if constexpr (std::is_same_v<M, Optimize>) {
      return;  // above
    } else if constexpr (std::is_same_v<M, Taubin>) {
      auto start = allocate();
      SweepStats stats;
      do {
        sweeper.copy(sweeper.current(), start.data());
        const std::int64_t held = sweeper.step(UniformMean{}, method.lambda).held +
                                  sweeper.step(UniformMean{}, method.mu).held;
        stats = measure_moves(executor, around.node_count, start.data(), sweeper.current());
        stats.held = held;
      } while (!sweeper.done(stats, watch));
    } else if constexpr (std::is_same_v<M, HcLaplacian>) {
      auto original = allocate();
      auto differences = allocate();
      sweeper.copy(sweeper.current(), original.data());
      while (!sweeper.done(sweeper.step_hc(method, original.data(), differences.data()), watch)) {
      }
    } else {
      with_mean(method.weighting, [&](const auto& mean) {
        // Sweeps without a host in between leave nobody to measure the mesh after each.
        if (options.history) {
          run_sweeps_one_by_one(sweeper, mean, method.relaxation, watch);
        } else {
          run_sweeps(executor, sweeper, mean, method.relaxation, watch);
        }
      });
    }
  };
  std::visit(run, options.method);
  if (sweeper.current() != positions) sweeper.copy(sweeper.current(), positions);
}

}  // namespace meshsmooth::detail

#pragma once

#include <type_traits>

#include "smooth/steps/form.hpp"
#include "smooth/steps/optimize.hpp"

namespace meshsmooth::detail {

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

/// Step 3: sweeps until the monitor reports the end.
///
/// takes  `positions` in internal order
/// gives  the smoothed positions in `positions`
/// cost   O(sweeps * entries); one or two more arrays of positions, one more for a
///        movement limit: `iterate_bytes`
template <Backend B, class Real>
void iterate(B& backend, const Surroundings& around,
             const Colouring<typename B::Executor>& colouring, const SmoothOptions& options,
             ConvergenceMonitor& monitor, const CallerPositions<Real>& given,
             Vec3<Real>* positions) {
  using E = typename B::Executor;
  if (monitor.done_at_once()) return;
  E& executor = backend.executor();
  const auto allocate = [&] { return executor.template allocate<Vec3<Real>>(around.node_count); };
  SweepContext<E, Real> context{around, &colouring, acceptance_of(options)};
  typename E::template Buffer<Vec3<Real>> home;
  if (options.movement_limit) {
    home = allocate();
    copy_positions(executor, around.node_count, positions, home.data());
    context.displacement_limit = {home.data(), monitor.in_mesh_unit(*options.movement_limit)};
  }
  if (const auto* method = std::get_if<Optimize>(&options.method)) {
    return optimize(backend, context, *method, monitor, given, positions);
  }
  Sweeper<E, Real> sweeper(executor, context, resolve_form(options), positions);

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
      } while (!sweeper.done(stats, monitor));
    } else if constexpr (std::is_same_v<M, HcLaplacian>) {
      auto original = allocate();
      auto differences = allocate();
      sweeper.copy(sweeper.current(), original.data());
      while (!sweeper.done(sweeper.step_hc(method, original.data(), differences.data()), monitor)) {
      }
    } else {
      with_mean(method.weighting, [&](const auto& mean) {
        // A history needs the mesh measured after each sweep, which batches do not allow.
        if (options.history) {
          run_sweeps_one_by_one(sweeper, mean, method.relaxation, monitor);
        } else {
          backend.sweep(sweeper, mean, method.relaxation, monitor);
        }
      });
    }
  };
  std::visit(run, options.method);
  if (sweeper.current() != positions) sweeper.copy(sweeper.current(), positions);
}

}  // namespace meshsmooth::detail

#pragma once

#include <concepts>

#include "smooth/optimize/optimize_sweeper.hpp"
#include "smooth/optimize/phase_monitor.hpp"

namespace meshsmooth::detail {

/// The sweeps of the optimizer for one coordinate type; see `OptimizingBackend`.
template <class B, class Real>
concept OptimizesIn = requires(B& backend, OptimizeSweeper<typename B::Executor, Real>& sweeper,
                               const OptimizePhase& phase, PhaseMonitor& monitor) {
  { backend.optimize_phase(sweeper, phase, monitor) } -> std::same_as<void>;
};

/// What the optimizer needs of a backend.
///
///   colour(surroundings, caller_ids)
///                         first-fit colours in the order of `colour_priority`
///   find_opposite_nodes(surroundings)
///                         `Surroundings::opposite` of a mesh of tetrahedra, empty for others
///   optimize_phase(sweeper, phase, monitor)
///                         sweeps of the optimizer until the phase's monitor reports the end
template <class B>
concept OptimizingBackend = requires(B& backend, const Surroundings& around,
                                     const NodeId* caller_ids) {
  { backend.executor() } -> std::same_as<typename B::Executor&>;
  { backend.colour(around, caller_ids) } -> std::same_as<Colouring<typename B::Executor>>;
  {
    backend.find_opposite_nodes(around)
    } -> std::same_as<typename B::Executor::template Buffer<NodeId>>;
}
&&Executor<typename B::Executor>&& OptimizesIn<B, float>&& OptimizesIn<B, double>;

}  // namespace meshsmooth::detail

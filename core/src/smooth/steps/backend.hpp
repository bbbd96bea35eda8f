#pragma once

#include <array>
#include <concepts>
#include <span>
#include <tuple>

#include "smooth/motion/kept_reference.hpp"
#include "smooth/rules/means.hpp"
#include "smooth/steps/job_mesh.hpp"
#include "smooth/steps/optimize_sweeper.hpp"
#include "smooth/steps/phase_monitor.hpp"
#include "smooth/steps/sweeper.hpp"

namespace meshsmooth::detail {

/// The steps of a backend for one coordinate type and one mean; see `Backend`.
template <class B, class Real, class Mean>
concept SweepsWith = requires(B& backend, Sweeper<typename B::Executor, Real>& sweeper,
                              const Mean& mean, ConvergenceMonitor& monitor) {
  { backend.sweep(sweeper, mean, 1.0, monitor) } -> std::same_as<void>;
};

/// Whether a backend sweeps with each of some means.
template <class B, class Real, class Means>
inline constexpr bool kSweepsWithEach = false;
template <class B, class Real, class... Mean>
inline constexpr bool kSweepsWithEach<B, Real, std::tuple<Mean...>> = (SweepsWith<B, Real, Mean> &&
                                                                       ...);

/// The steps of a backend for one coordinate type; see `Backend`.
template <class B, class Real>
concept BackendOf = requires(
    B& backend, const TopologyView& topology, std::span<const Vec3<Real>> given,
    const SmoothOptions& options, const JobControl& control, StageTimes& times,
    JobMesh<typename B::Executor, Real>& job, OptimizeSweeper<typename B::Executor, Real>& sweeper,
    const OptimizePhase& phase, PhaseMonitor& monitor, const typename B::Orientation& orientation,
    std::span<Vec3<Real>> positions, Sweeper<typename B::Executor, Real>& jacobi,
    const std::array<LaplacianStep<UniformMean, Real>, 2>& two_steps,
    const std::array<HcStep<Real>, 1>& one_step, ConvergenceMonitor& sweeps) {
  { backend.sweep_steps(jacobi, two_steps, sweeps) } -> std::same_as<void>;
  { backend.sweep_steps(jacobi, one_step, sweeps) } -> std::same_as<void>;
  {
    backend.prepare(topology, given, options, control, times)
    } -> std::same_as<JobMesh<typename B::Executor, Real>>;
  { backend.optimize_phase(sweeper, phase, monitor) } -> std::same_as<void>;
  { backend.orient(job) } -> std::same_as<typename B::Orientation>;
  { backend.evaluate(job, orientation) } -> std::same_as<QualityStats>;
  { backend.evaluate_result(job, orientation) } -> std::same_as<QualityReport>;
  {
    backend.evaluate_elements(job, orientation, options.element_quality_metrics)
    } -> std::same_as<ElementQualityArrays>;
  { backend.write_back(job, positions) } -> std::same_as<const std::int64_t*>;
}
&&kSweepsWithEach<B, Real, Means>;

/// One job on one backend: what the pipeline needs, complete. Each step has one text per
/// backend; the rules and the steps over an `Executor` are shared. An object serves one job.
///
///   Executor              where the shared steps run; `executor()` gives it
///   Orientation           what surface elements must not turn against, for a job:
///                         `references()` and `common()` as `Surroundings` has them
///   kept_reference()         where a motion finds its Laplace system, and keeps it; null: nowhere
///   keep(buffer)          moves a buffer there
///   prepare(topology, positions, options, control, times)
///                         steps 1 and 2: order of nodes and elements, rings, balls, boundary,
///                         fixed nodes. Throws InvalidMesh
///   colour(surroundings, caller_ids)
///                         first-fit colours in the order of `colour_priority`
///   sweep(sweeper, mean, factor, monitor)
///                         sweeps of a Laplacian method until the monitor reports the end; the
///                         same bits as `run_sweeps_one_by_one`
///   sweep_steps(sweeper, steps, monitor)
///                         the same for sweeps of one or two steps of Jacobi form; the same bits
///                         as `run_steps_one_by_one`
///   find_opposite_nodes(surroundings)
///                         `Surroundings::opposite` of a mesh of tetrahedra, empty for others
///   optimize_phase(sweeper, phase, monitor)
///                         sweeps of the optimizer until the phase's monitor reports the end
///   orient(job)           the Orientation, before anything moves
///   evaluate(job, orientation)
///                         the quality of the current mesh
///   evaluate_result(job, orientation)
///                         the same, and the elements that could not change
///   evaluate_elements(job, orientation, metrics)
///                         the metrics of every element of the current mesh, in the caller's
///                         order; equals `measure_elements`
///   write_back(job, positions)
///                         free nodes to the caller's array, after the last chance to end without
///                         a result; gives how many differ from the input, known after
///                         `Executor::finish`
template <class B>
concept Backend = requires(B& backend, const Surroundings& around, const NodeId* caller_ids,
                           typename B::Executor::template Buffer<NodeId>& ids,
                           const typename B::Orientation& orientation) {
  { backend.executor() } -> std::same_as<typename B::Executor&>;
  { backend.kept_reference() } -> std::same_as<KeptReference<typename B::Executor>*>;
  { backend.keep(ids) } -> std::same_as<void>;
  { backend.colour(around, caller_ids) } -> std::same_as<Colouring<typename B::Executor>>;
  {
    backend.find_opposite_nodes(around)
    } -> std::same_as<typename B::Executor::template Buffer<NodeId>>;
  { orientation.references() } -> std::same_as<const PackedDirection*>;
  { orientation.common() } -> std::same_as<Vec3d>;
}
&&Executor<typename B::Executor>&& BackendOf<B, float>&& BackendOf<B, double>;

}  // namespace meshsmooth::detail

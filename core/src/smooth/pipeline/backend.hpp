#pragma once

#include <concepts>
#include <span>

#include "smooth/averaging/averaging_backend.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/linear/solving_backend.hpp"
#include "smooth/optimize/optimizing_backend.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// The steps of every job for one coordinate type; see `Backend`.
template <class B, class Real>
concept PipelineBackend = requires(B& backend, const TopologyView& topology,
                                   std::span<const Vec3<Real>> given, const JobPlan& plan,
                                   const JobControl& control, StageTimes& times,
                                   JobMesh<typename B::Executor, Real>& job,
                                   const typename B::Orientation& orientation,
                                   std::span<Vec3<Real>> positions) {
  {
    backend.prepare(topology, given, plan, control, times)
    } -> std::same_as<JobMesh<typename B::Executor, Real>>;
  { backend.orient(job) } -> std::same_as<typename B::Orientation>;
  { backend.evaluate(job, orientation) } -> std::same_as<QualityStats>;
  { backend.evaluate_result(job, orientation) } -> std::same_as<QualityReport>;
  {
    backend.evaluate_elements(job, orientation, plan.options.element_quality_metrics)
    } -> std::same_as<ElementQualityArrays>;
  { backend.write_back(job, positions) } -> std::same_as<const std::int64_t*>;
};

/// One job on one backend: what the pipeline needs, complete. Each step has one text per
/// backend; the rules and the steps over an `Executor` are shared. An object serves one job.
/// Besides what the methods need (`AveragingBackend`, `OptimizingBackend`, `SolvingBackend`):
///
///   Executor              where the shared steps run; `executor()` gives it
///   Orientation           what surface elements must not turn against, for a job:
///                         `references()` and `common()` as `Surroundings` has them
///   prepare(topology, positions, plan, control, times)
///                         steps 1 and 2: order of nodes and elements, rings, balls, boundary,
///                         fixed nodes. Throws InvalidMesh
///   orient(job)           the Orientation, before anything moves
///   evaluate(job, orientation)
///                         the quality of the current mesh
///   evaluate_result(job, orientation)
///                         the same, and the elements that could not change. May begin to write
///                         back, where the result may change though the job fails
///                         (`JobPositions::kept_on_error`); the job may still change the mesh and
///                         evaluate it again
///   evaluate_elements(job, orientation, metrics)
///                         the metrics of every element of the current mesh, in the caller's
///                         order; equals `measure_elements`
///   write_back(job, positions)
///                         free nodes to the caller's array, after the last chance to end without
///                         a result; gives how many differ from the input, known after
///                         `Executor::finish`
template <class B>
concept Backend = requires(const typename B::Orientation& orientation) {
  { orientation.references() } -> std::same_as<const PackedDirection*>;
  { orientation.common() } -> std::same_as<Vec3d>;
}
&&SolvingBackend<B>&& OptimizingBackend<B>&& AveragingBackend<B, float>&&
    AveragingBackend<B, double>&& PipelineBackend<B, float>&& PipelineBackend<B, double>;

}  // namespace meshsmooth::detail

#pragma once

#include <utility>

#include "meshsmooth/smoother.hpp"
#include "smooth/cpu/neighbours.hpp"
#include "smooth/rules/fixed_nodes.hpp"
#include "smooth/steps/boundary.hpp"
#include "smooth/steps/job_topology.hpp"

namespace meshsmooth::detail {

/// Tells the watcher that a stage has begun; its time is that until the end of
/// the object.
template <Executor E>
class StageTimer {
 public:
  StageTimer(E& executor, double& seconds, const JobControl& control, Stage stage)
      : timer_(executor, seconds) {
    if (control.on_progress) control.on_progress({stage, 0, 0, 0});
  }

 private:
  typename E::Timer timer_;
};

/// What is found out about the elements of a result.
struct Verdict {
  QualityStats quality;
  LockedStats locked;
};

/// A mesh as the sweeps need it, in internal numbers.
template <Executor E, class Real>
struct JobMesh {
  std::size_t node_count = 0;
  typename E::template HostArray<Vec3<Real>> given;  // the caller's positions
  typename E::template Buffer<NodeId> caller_ids;    // internal node -> caller's
  JobElements<E> elements;
  RowBuffer<E, ElementId> balls;
  RowBuffer<E, NodeId> rings;
  typename E::template Buffer<Vec3<Real>> places;
  typename E::template Buffer<std::uint8_t> fixed;  // 1: the node stays
  Box box{};
  NodeCounts nodes;
  std::size_t free_count = 0;

  [[nodiscard]] bool volume() const { return elements.dimension == 3; }
};

/// `fix_nodes` of a job whose `fixed` has the boundary's marks.
template <Executor E, class Real>
void fix_nodes(E& executor, const TopologyView& topology, const SmoothOptions& options,
               JobMesh<E, Real>& job) {
  auto mask = executor.in_executor_memory(topology.fixed);
  const FixedCounts counts =
      fix_nodes(executor, job.node_count, job.rings.view(),
                FixRule{job.caller_ids.data(), topology.fixed.empty() ? nullptr : mask.data(),
                        options.boundary != BoundaryPolicy::free, job.fixed.data()});
  job.nodes = counts.nodes;
  job.free_count = static_cast<std::size_t>(counts.free);
}

/// Steps 1 and 2: numbers along a curve, balls, rings, boundary.
///
/// takes  the caller's mesh in host memory, its sizes valid
/// cost   see the steps
template <Executor E, class Real>
JobMesh<E, Real> prepare_job(E& executor, const TopologyView& topology,
                             std::span<const Vec3<Real>> positions, const SmoothOptions& options,
                             const JobControl& control, StageTimes& times) {
  const std::size_t node_count = topology.node_count;
  JobMesh<E, Real> job;
  job.node_count = node_count;
  {
    const StageTimer timer(executor, times.find_neighbours_seconds, control,
                           Stage::find_neighbours);
    job.given = executor.in_executor_memory(positions);
    job.box = find_box(executor, job.given.data(), node_count);
    Renumbering<E> renumbering = renumber_nodes(executor, job.given.data(), node_count, job.box);
    job.places = places_of(executor, job.given.data(), renumbering.caller_ids.data(), node_count);
    job.elements = renumber_elements(executor, topology, renumbering.internal_of.data());
    renumbering.internal_of = {};
    job.caller_ids = std::move(renumbering.caller_ids);
    job.balls = find_balls(executor, node_count, job.elements.view, job.elements.caller_ids.data());
    job.rings = find_rings(executor, node_count, job.elements.view, job.balls.view(),
                           job.caller_ids.data());
  }
  {
    const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
    job.fixed = executor.template allocate<std::uint8_t>(node_count);
    if (!find_boundary(executor, node_count, job.elements.view, job.balls.view(),
                       job.fixed.data())) {
      throw_overused_facet(topology);
    }
    fix_nodes(executor, topology, options, job);
  }
  return job;
}

}  // namespace meshsmooth::detail

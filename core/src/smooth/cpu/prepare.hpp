#pragma once

#include <utility>

#include "smooth/cpu/boundary.hpp"
#include "smooth/cpu/incidence.hpp"
#include "smooth/cpu/job_elements.hpp"
#include "smooth/cpu/node_order.hpp"
#include "smooth/rules/fixed_nodes.hpp"
#include "smooth/steps/positions.hpp"
#include "smooth/steps/refusals.hpp"

namespace meshsmooth::detail {

/// Applies `FixRule` to all nodes of a job whose `fixed` has the boundary's marks.
template <class Real>
void fix_nodes(CpuExecutor& executor, const TopologyView& topology, const SmoothOptions& options,
               JobMesh<CpuExecutor, Real>& job) {
  const FixRule rule{job.caller_ids.data(),
                     topology.fixed.empty() ? nullptr : topology.fixed.data(),
                     options.boundary != BoundaryPolicy::free, job.fixed.data()};
  const Rows<NodeId> rings = job.rings.view();
  const FixedCounts counts = executor.reduce(
      job.node_count, FixedCounts{},
      [=](std::size_t node) { return rule(node, rings.size(node) == 0); }, Plus{});
  job.nodes = counts.nodes;
  job.free_count = static_cast<std::size_t>(counts.free);
}

/// Steps 1 and 2: nodes in the order of a space-filling curve, balls, rings, boundary.
///
/// takes  the caller's mesh in host memory, valid
/// cost   see the steps
template <class Real>
JobMesh<CpuExecutor, Real> prepare_job(CpuExecutor& executor, const TopologyView& topology,
                                       std::span<const Vec3<Real>> positions,
                                       const SmoothOptions& options, const JobControl& control,
                                       StageTimes& times) {
  const std::size_t node_count = topology.node_count;
  JobMesh<CpuExecutor, Real> job;
  job.node_count = node_count;
  {
    const StageTimer timer(executor, times.find_neighbours_seconds, control,
                           Stage::find_neighbours);
    job.given = positions;
    job.box = find_box(executor, job.given.data(), node_count);
    Renumbering renumbering = renumber_nodes(executor, job.given.data(), node_count, job.box);
    job.positions =
        positions_in_order(executor, job.given.data(), renumbering.caller_ids.data(), node_count);
    job.elements = renumber_elements(executor, topology, renumbering.internal_of.data());
    renumbering.internal_of = {};
    job.caller_ids = std::move(renumbering.caller_ids);
    job.balls = find_balls(executor, node_count, job.elements.view, job.elements.caller_ids.data());
    job.rings = find_rings(executor, node_count, job.elements.view, job.balls.view(),
                           job.caller_ids.data());
  }
  {
    const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
    job.fixed = executor.allocate<std::uint8_t>(node_count);
    if (!find_boundary(executor, node_count, job.elements.view, job.balls.view(),
                       job.fixed.data())) {
      throw_overused_facet(topology);
    }
    fix_nodes(executor, topology, options, job);
  }
  return job;
}

}  // namespace meshsmooth::detail

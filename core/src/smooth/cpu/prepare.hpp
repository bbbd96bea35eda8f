#pragma once

#include <memory>
#include <utility>

#include "meshsmooth/smoother.hpp"
#include "smooth/base/fixed_nodes.hpp"
#include "smooth/base/positions.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/cpu/boundary.hpp"
#include "smooth/cpu/incidence.hpp"
#include "smooth/cpu/job_elements.hpp"
#include "smooth/cpu/node_order.hpp"
#include "smooth/linear/kept_reference.hpp"
#include "smooth/plan/job_plan.hpp"

namespace meshsmooth::detail {

/// Elements, balls and rings of a job or of a prepared topology, in a new order of the nodes.
template <class Target>
void find_incidence(CpuExecutor& executor, const TopologyView& topology, Renumbering order,
                    Target& to) {
  const std::size_t node_count = topology.node_count;
  to.elements = renumber_elements(executor, topology, order.internal_of.data());
  order.internal_of = {};
  executor.bytes().enter(JobStage::find_neighbours);
  to.caller_ids = std::move(order.caller_ids);
  to.balls = find_balls(executor, node_count, to.elements.view, to.elements.caller_ids.data());
  to.rings =
      find_rings(executor, node_count, to.elements.view, to.balls.view(), to.caller_ids.data());
}

/// Marks the boundary of the same, see `find_boundary`. Throws InvalidMesh.
template <class Target>
CpuBuffer<std::uint8_t> mark_boundary(CpuExecutor& executor, const TopologyView& topology,
                                      const Target& of) {
  auto marks = executor.allocate<std::uint8_t>(topology.node_count);
  if (!find_boundary(executor, topology.node_count, of.elements.view, of.balls.view(),
                     marks.data())) {
    throw_overused_facet(topology);
  }
  return marks;
}

/// Applies `FixRule` to all nodes of a job whose `fixed` has the boundary's marks.
template <class Real>
void fix_nodes(CpuExecutor& executor, const TopologyView& topology, const JobPlan& plan,
               JobMesh<CpuExecutor, Real>& job) {
  const FixRule rule{job.caller_ids.data(),
                     topology.fixed.empty() ? nullptr : topology.fixed.data(),
                     plan.options.boundary != BoundaryPolicy::free, job.fixed.data()};
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
                                       std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                       const JobControl& control, StageTimes& times) {
  const std::size_t node_count = topology.node_count;
  JobMesh<CpuExecutor, Real> job;
  job.node_count = node_count;
  {
    const StageTimer timer(executor, times.find_neighbours_seconds, control,
                           Stage::find_neighbours);
    executor.bytes().enter(JobStage::order_nodes);
    job.given = positions;
    job.box = find_box(executor, job.given.data(), node_count);
    Renumbering renumbering = renumber_nodes(executor, job.given.data(), node_count, job.box);
    job.positions =
        positions_in_order(executor, job.given.data(), renumbering.caller_ids.data(), node_count);
    find_incidence(executor, topology, std::move(renumbering), job);
  }
  {
    const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
    executor.bytes().enter(JobStage::find_boundary);
    job.fixed = mark_boundary(executor, topology, job);
    fix_nodes(executor, topology, plan, job);
  }
  return job;
}

/// Order, elements, rings, balls and boundary, shared by concurrent jobs.
struct CpuPreparedTopology final : PreparedTopology {
  ByteCount count;  // of the buffers, so before them
  CpuBuffer<NodeId> caller_ids;
  JobElements<CpuExecutor> elements;
  RowBuffer<CpuExecutor, ElementId> balls;
  RowBuffer<CpuExecutor, NodeId> rings;
  CpuBuffer<std::uint8_t> on_boundary;
  std::int64_t boundary_nodes = 0;
  std::unique_ptr<KeptReference<CpuExecutor>> kept;  // if there is a reference

  [[nodiscard]] MemoryEstimate bytes() const override {
    return {static_cast<std::int64_t>(count.now()) + (kept ? kept->most_bytes() : 0), 0};
  }
  [[nodiscard]] std::int64_t boundary_node_count() const override { return boundary_nodes; }
};

/// Steps 1 and 2 without positions.
///
/// takes  a valid topology
/// cost   about twice that of `prepare_job`
inline std::shared_ptr<CpuPreparedTopology> prepare_topology(CpuExecutor& executor,
                                                             const TopologyView& topology,
                                                             const JobControl& control,
                                                             const PositionsView& reference) {
  const std::size_t node_count = topology.node_count;
  auto result = std::make_shared<CpuPreparedTopology>();
  result->topology = topology;
  if (position_count(reference) > 0) {
    result->reference = reference;
    result->kept = std::make_unique<KeptReference<CpuExecutor>>(
        kept_system_bytes(count_mesh(size_of(topology))));
  }
  const auto report = [&](Stage stage) {
    if (control.on_progress) control.on_progress({stage, 0, 0, 0});
  };

  report(Stage::find_neighbours);
  Renumbering order;
  {
    auto identity = executor.allocate<NodeId>(node_count);
    NodeId* const same = identity.data();
    executor.for_each(node_count,
                      [=](std::size_t node) { same[node] = static_cast<NodeId>(node); });
    const JobElements<CpuExecutor> elements = renumber_elements(executor, topology, same);
    const auto balls = find_balls(executor, node_count, elements.view, elements.caller_ids.data());
    const auto rings = find_rings(executor, node_count, elements.view, balls.view(), same);
    order = renumber_by_rings(executor, node_count, rings.view());
  }
  find_incidence(executor, topology, std::move(order), *result);

  report(Stage::find_boundary);
  result->on_boundary = mark_boundary(executor, topology, *result);
  const std::uint8_t* const on_boundary = result->on_boundary.data();
  result->boundary_nodes = executor.reduce(
      node_count, std::int64_t{0},
      [=](std::size_t node) -> std::int64_t { return on_boundary[node] == kOnBoundary ? 1 : 0; },
      Plus{});

  // The buffers outlive the job that made them.
  const auto keep = [&](auto&... buffers) { (buffers.count_by(result->count), ...); };
  keep(result->caller_ids, result->elements.connectivity, result->elements.caller_ids,
       result->balls.offsets, result->balls.entries, result->rings.offsets, result->rings.entries,
       result->on_boundary);
  return result;
}

/// `prepare_job` on a prepared topology; of `topology` it reads the fixed nodes.
template <class Real>
JobMesh<CpuExecutor, Real> prepare_job(CpuExecutor& executor, const CpuPreparedTopology& prepared,
                                       const TopologyView& topology,
                                       std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                       const JobControl& control, StageTimes& times) {
  const std::size_t node_count = prepared.topology.node_count;
  JobMesh<CpuExecutor, Real> job;
  job.node_count = node_count;
  {
    const StageTimer timer(executor, times.find_neighbours_seconds, control,
                           Stage::find_neighbours);
    executor.bytes().enter(JobStage::order_nodes);
    job.given = positions;
    job.box = find_box(executor, positions.data(), node_count);
    job.caller_ids = prepared.caller_ids.borrow();
    job.positions =
        positions_in_order(executor, positions.data(), job.caller_ids.data(), node_count);
    job.elements = {prepared.elements.view, prepared.elements.dimension,
                    prepared.elements.connectivity.borrow(), prepared.elements.caller_ids.borrow()};
    job.balls = {prepared.balls.offsets.borrow(), prepared.balls.entries.borrow()};
    job.rings = {prepared.rings.offsets.borrow(), prepared.rings.entries.borrow()};
  }
  {
    const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
    executor.bytes().enter(JobStage::find_boundary);
    job.fixed = executor.allocate<std::uint8_t>(node_count);
    executor.upload(prepared.on_boundary.data(), node_count, job.fixed.data());
    fix_nodes(executor, topology, plan, job);
  }
  return job;
}

}  // namespace meshsmooth::detail

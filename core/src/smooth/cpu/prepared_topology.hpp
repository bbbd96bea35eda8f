#pragma once

#include <memory>
#include <utility>

#include "meshsmooth/smoother.hpp"
#include "smooth/cpu/prepare.hpp"

namespace meshsmooth::detail {

/// Order, elements, rings, balls and boundary, shared by concurrent jobs.
struct CpuPreparedTopology final : PreparedTopology {
  ByteCount count;  // of the buffers, so before them
  CpuBuffer<NodeId> caller_ids;
  JobElements<CpuExecutor> elements;
  RowBuffer<CpuExecutor, ElementId> balls;
  RowBuffer<CpuExecutor, NodeId> rings;
  CpuBuffer<std::uint8_t> on_boundary;
  std::int64_t boundary_nodes = 0;

  [[nodiscard]] MemoryEstimate bytes() const override {
    return {static_cast<std::int64_t>(count.now()), 0};
  }
  [[nodiscard]] std::int64_t boundary_node_count() const override { return boundary_nodes; }
};

/// Steps 1 and 2 without positions.
///
/// takes  a valid topology
/// cost   about twice that of `prepare_job`
inline std::shared_ptr<CpuPreparedTopology> prepare_topology(CpuExecutor& executor,
                                                             const TopologyView& topology,
                                                             const JobControl& control) {
  const std::size_t node_count = topology.node_count;
  auto result = std::make_shared<CpuPreparedTopology>();
  result->topology = topology;
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
  result->elements = renumber_elements(executor, topology, order.internal_of.data());
  order.internal_of = {};
  result->caller_ids = std::move(order.caller_ids);
  result->balls =
      find_balls(executor, node_count, result->elements.view, result->elements.caller_ids.data());
  result->rings = find_rings(executor, node_count, result->elements.view, result->balls.view(),
                             result->caller_ids.data());

  report(Stage::find_boundary);
  result->on_boundary = executor.allocate<std::uint8_t>(node_count);
  std::uint8_t* const on_boundary = result->on_boundary.data();
  if (!find_boundary(executor, node_count, result->elements.view, result->balls.view(),
                     on_boundary)) {
    throw_overused_facet(topology);
  }
  result->boundary_nodes = executor.reduce(
      node_count, std::int64_t{0},
      [=](std::size_t node) -> std::int64_t { return on_boundary[node] != 0 ? 1 : 0; }, Plus{});

  // The buffers outlive the job that made them.
  const auto keep = [&](auto&... buffers) { (buffers.count_by(result->count), ...); };
  keep(result->caller_ids, result->elements.connectivity, result->elements.caller_ids,
       result->balls.offsets, result->balls.entries, result->rings.offsets, result->rings.entries,
       result->on_boundary);
  return result;
}

/// `prepare_job` on a prepared topology.
template <class Real>
JobMesh<CpuExecutor, Real> prepare_job(CpuExecutor& executor, const CpuPreparedTopology& prepared,
                                       std::span<const Vec3<Real>> positions,
                                       const SmoothOptions& options, const JobControl& control,
                                       StageTimes& times) {
  const std::size_t node_count = prepared.topology.node_count;
  JobMesh<CpuExecutor, Real> job;
  job.node_count = node_count;
  {
    const StageTimer timer(executor, times.find_neighbours_seconds, control,
                           Stage::find_neighbours);
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
    job.fixed = executor.allocate<std::uint8_t>(node_count);
    executor.upload(prepared.on_boundary.data(), node_count, job.fixed.data());
    fix_nodes(executor, prepared.topology, options, job);
  }
  return job;
}

}  // namespace meshsmooth::detail

#pragma once

#include <span>

#include "smooth/base/job_mesh.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/cuda/topology/node_order.cuh"
#include "smooth/cuda/topology/ring_kernel.cuh"

namespace meshsmooth::detail {

/// Bytes of a prepared mesh without its rows: two arrays of positions, the caller's ids, marks,
/// elements.
[[nodiscard]] inline std::int64_t job_bytes(const MeshCounts& mesh) {
  return mesh.nodes * (2 * mesh.position_bytes + 4 + 1) + mesh.entries * 4 +
         (mesh.types > 1 ? mesh.elements * 4 : 0);
}

/// What a job needs in addition to its mesh until its rings are known.
struct Preparation {
  DeviceBuffer<std::uint8_t> mask;  // the caller's fixed nodes
  std::vector<UploadedChunk> chunks;
  std::size_t uploads_end = 0;  // a mark
  DeviceBuffer<PrepareState> state;
  DeviceBuffer<NodeId> internal_of;
  DeviceBuffer<std::uint32_t> ball_sizes;
  FoundBalls balls;  // freed behind the last mark: that costs the host 4 to 10 us

  /// As the host sees the state after a search.
  [[nodiscard]] static const PrepareState& found(CudaExecutor& executor) {
    return *executor.lane().mapped<PrepareState>(CudaLane::kStateOffset);
  }
};

/// Queues the copies of the whole mesh, in the stream of uploads. The main stream waits for the
/// positions.
template <class Real>
void upload_job(CudaExecutor& executor, const TopologyView& topology,
                std::span<const Vec3<Real>> positions, DeviceBuffer<NodeId> connectivity,
                JobMesh<CudaExecutor, Real>& job, Preparation& preparation, StageTimes& times) {
  executor.start_uploads();
  const std::size_t begin = executor.mark(executor.lane().uploads);
  executor.upload_early(positions.data(), job.node_count, job.given.data());
  executor.await_uploads();
  executor.upload_early(topology.fixed.data(), topology.fixed.size(), preparation.mask.data());
  job.elements = upload_elements(executor, topology, std::move(connectivity), preparation.chunks);
  preparation.uploads_end = executor.mark(executor.lane().uploads);
  executor.add_interval(begin, preparation.uploads_end, times.upload_seconds);
}

/// Queues the order of the nodes, while the elements are still being copied.
template <class Real>
void order_job(CudaExecutor& executor, JobMesh<CudaExecutor, Real>& job, Preparation& preparation) {
  const std::size_t node_count = job.node_count;
  job.positions = executor.allocate<Vec3<Real>>(node_count);
  job.fixed = executor.allocate<std::uint8_t>(node_count);
  preparation.state = executor.allocate<PrepareState>(1);
  executor.clear(preparation.state.data(), 1);
  job.caller_ids = executor.allocate<NodeId>(node_count);
  preparation.internal_of = executor.allocate<NodeId>(node_count);
  preparation.ball_sizes = executor.allocate<std::uint32_t>(node_count + 1);
  order_nodes(executor,
              NodeOrder<Real>{node_count, job.given.data(), job.caller_ids.data(),
                              preparation.internal_of.data(), job.positions.data(),
                              job.fixed.data(), preparation.ball_sizes.data()},
              preparation.state.data());
}

/// Throws if the kernels have found the mesh invalid; `validate_on_host` names what is wrong.
template <class Validate>
void refuse_invalid(const PrepareState& found, const TopologyView& topology,
                    const Validate& validate_on_host) {
  if (found.wrong_position != 0 || found.wrong_element != 0) {
    validate_on_host();
    throw DeviceError("DEVICE_LOST", "the device rejects a mesh that the host finds valid", true);
  }
  const bool volume = element_shape(topology.blocks.front().type).dimension == 3;
  if (volume && found.overfull_ball == 0 && found.overused_facet != 0)
    throw_overused_facet(topology);
}

/// Resets the state for another search for rings: it keeps the box.
inline void reset_state(CudaExecutor& executor, const PrepareState& found, PrepareState* state) {
  PrepareState again{};
  std::ranges::copy(found.lower, again.lower);
  std::ranges::copy(found.upper, again.upper);
  executor.upload(&again, 1, state);
}

/// Balls, rings, boundary and fixed nodes. Searches again with more room, or with balls in rows,
/// where the first choice did not suffice. Returns the mark behind the last search.
template <class Real, class Validate>
std::size_t find_topology(CudaExecutor& executor, const TopologyView& topology, BallPlan plan,
                          bool boundary_fixed, const JobControl& control,
                          JobMesh<CudaExecutor, Real>& job, Preparation& preparation,
                          const Validate& validate_on_host) {
  const std::size_t node_count = job.node_count;
  PrepareState* const state = preparation.state.data();
  const PrepareState& found = preparation.found(executor);
  FoundBalls& balls = preparation.balls;
  balls = find_balls(executor, node_count, job.elements, plan, preparation.internal_of.data(),
                     std::move(preparation.ball_sizes), preparation.chunks, state);
  preparation.internal_of = {};
  const FixRule fix{job.caller_ids.data(),
                    topology.fixed.empty() ? nullptr : preparation.mask.data(), boundary_fixed,
                    job.fixed.data()};
  for (std::size_t capacity = ring_entry_estimate(size_of(topology));;
       capacity = std::max<std::size_t>(capacity, found.ring_entries)) {
    job.rings = {};
    job.rings =
        find_rings(executor, node_count, job.elements, balls, plan.kept, capacity, fix, state);
    const std::size_t end = executor.mark(executor.lane().stream);
    if (control.on_progress) control.on_progress({Stage::find_boundary, 0, 0, 0});
    executor.synchronize();
    executor.check();
    refuse_invalid(found, topology, validate_on_host);
    if (found.overfull_ball == 0 && found.ring_entries <= capacity) {
      if (plan.kept) job.balls = std::move(balls.rows);
      return end;
    }
    executor.clear(job.fixed.data(), node_count);
    reset_state(executor, found, state);
    if (found.overfull_ball == 0) continue;
    plan.slotted = false;
    DeviceBuffer<std::uint32_t> ball_sizes = std::move(balls.sizes);
    balls = {};
    executor.clear(ball_sizes.data(), ball_sizes.size());
    balls = find_balls(executor, node_count, job.elements, plan, nullptr, std::move(ball_sizes),
                       preparation.chunks, state);
  }
}

/// Prepares a job on the device: upload, order, balls, rings, boundary. Copies overlap with
/// kernels, and the host waits once, at the end. An invalid mesh is detected by the kernels and
/// then named by the host.
template <class Real>
JobMesh<CudaExecutor, Real> prepare_job(CudaExecutor& executor, const TopologyView& topology,
                                        std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                        const JobControl& control, StageTimes& times) {
  if (control.on_progress) control.on_progress({Stage::find_neighbours, 0, 0, 0});
  executor.bytes().enter(JobStage::order_nodes);
  JobMesh<CudaExecutor, Real> job;
  job.node_count = topology.node_count;
  job.given = executor.allocate<Vec3<Real>>(job.node_count);
  Preparation preparation;
  preparation.mask = executor.allocate<std::uint8_t>(topology.fixed.size());
  auto connectivity = allocate_connectivity(executor, topology);
  // However this ends, the copies end before the memory is freed.
  const UploadsEnd uploads_end_first(executor);
  upload_job(executor, topology, positions, std::move(connectivity), job, preparation, times);
  order_job(executor, job, preparation);
  executor.bytes().enter(JobStage::find_neighbours);
  const std::size_t rings_end =
      find_topology(executor, topology, BallPlan::of(size_of(topology), plan),
                    plan.options.boundary != BoundaryPolicy::free, control, job, preparation, [&] {
                      // What the device has seen: the caller may change its array meanwhile.
                      validate(topology, std::span<const Vec3<Real>>(executor.to_host(job.given)));
                    });
  const PrepareState& found = preparation.found(executor);
  executor.add_interval(preparation.uploads_end, rings_end, times.find_neighbours_seconds);
  executor.add_interval(rings_end, executor.mark(executor.lane().stream),
                        times.find_boundary_seconds);
  job.box = box_of(found);
  job.nodes.total = static_cast<std::int64_t>(job.node_count);
  job.nodes.boundary = static_cast<std::int64_t>(found.boundary);
  job.nodes.fixed = static_cast<std::int64_t>(found.fixed);
  job.nodes.isolated = static_cast<std::int64_t>(found.isolated);
  job.nodes.on_non_manifold_edges = static_cast<std::int64_t>(found.on_non_manifold_edges);
  job.free_count = static_cast<std::size_t>(found.free);
  return job;
}

}  // namespace meshsmooth::detail

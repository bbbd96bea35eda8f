#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "smooth/cuda/topology/landmarks.cuh"
#include "smooth/cuda/topology/prepare.cuh"
#include "smooth/linear/kept_reference.hpp"
#include "smooth/move/prescribed.hpp"

namespace meshsmooth::detail {

/// Memory of a device for what outlives a job, shared by the lanes of the device. What is freed
/// goes back to the driver.
class KeptMemory {
 public:
  explicit KeptMemory(int device) : device_(device), pool_(stream_, device, 0, 0) {}

  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] DevicePool& pool() { return pool_; }
  /// Waits until what was allocated may be used by any stream.
  void synchronize() const { stream_.synchronize(); }

  /// That of a device, which exists while somebody has it.
  [[nodiscard]] static std::shared_ptr<KeptMemory> of(int device) {
    static std::mutex mutex;
    static std::array<std::weak_ptr<KeptMemory>, kMostDevices> known;
    const std::lock_guard lock(mutex);
    std::weak_ptr<KeptMemory>& here = known.at(static_cast<std::size_t>(device));
    std::shared_ptr<KeptMemory> memory = here.lock();
    if (!memory) here = memory = std::make_shared<KeptMemory>(device);
    return memory;
  }

 private:
  int device_;
  Stream stream_;
  DevicePool pool_;  // without an arena, so that threads may share it
};

/// Order, elements, rings, balls and boundary in device memory, shared by concurrent jobs of all
/// lanes of the device.
struct CudaPreparedTopology final : PreparedTopology {
  explicit CudaPreparedTopology(int device) : memory(KeptMemory::of(device)) {}
  ~CudaPreparedTopology() override { cudaSetDevice(memory->device()); }

  std::shared_ptr<KeptMemory> memory;  // this and the count before the buffers
  ByteCount count;
  DeviceBuffer<NodeId> caller_ids;
  JobElements<CudaExecutor> elements;  // shapes and nodes of its runs: see `borrow_elements`
  RowBuffer<CudaExecutor, ElementId> balls;
  RowBuffer<CudaExecutor, NodeId> rings;
  DeviceBuffer<std::uint8_t> on_boundary;
  std::int64_t boundary_nodes = 0;
  std::unique_ptr<KeptReference<CudaExecutor>> kept;  // if there is a reference
  std::variant<DeviceBuffer<Vec3f>, DeviceBuffer<Vec3d>> reference_positions;  // as given

  [[nodiscard]] MemoryEstimate bytes() const override {
    return {0, static_cast<std::int64_t>(count.now()) + (kept ? kept->most_bytes() : 0)};
  }
  [[nodiscard]] std::int64_t boundary_node_count() const override { return boundary_nodes; }
};

/// Bytes of `CudaPreparedTopology`, an upper bound.
[[nodiscard]] inline std::int64_t prepared_device_bytes(const MeshSize& size) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t bytes =
      mesh.nodes * (4 + 1) + mesh.entries * 4 + (mesh.types > 1 ? mesh.elements * 4 : 0) +
      row_bytes(mesh.nodes, mesh.entries) + row_bytes(mesh.nodes, 2 * mesh.edges);
  const std::int64_t reference = mesh.nodes * std::int64_t{sizeof(Vec3d)} + kept_system_bytes(mesh);
  return bytes + bytes / 50 + (size.reference ? reference : 0);
}

/// Copies the first `size` values of a job's buffer into memory that outlives it.
template <class T>
DeviceBuffer<T> keep(CudaExecutor& executor, KeptMemory& memory, ByteCount& count,
                     const DeviceBuffer<T>& from, std::size_t size) {
  DeviceBuffer<T> kept(size, {memory.pool(), count});
  memory.synchronize();
  executor.copy(from.data(), size, kept.data());
  return kept;
}

/// Steps 1 and 2 without positions. Nodes are ordered by the topology alone: all meshes with one
/// topology share the result, and their jobs have the same bits whichever came first.
///
/// takes  a topology whose sizes are valid
/// cost   two searches for rings, and `place_by_edges`
inline std::shared_ptr<const CudaPreparedTopology> prepare_topology(
    CudaExecutor& executor, const TopologyView& topology, const JobControl& control,
    const PositionsView& reference) {
  if (control.on_progress) control.on_progress({Stage::find_neighbours, 0, 0, 0});
  const std::size_t node_count = topology.node_count;
  JobMesh<CudaExecutor, float> job;
  job.node_count = node_count;
  job.given = executor.allocate<Vec3f>(node_count);
  Preparation preparation;
  auto connectivity = allocate_connectivity(executor, topology);
  executor.clear(connectivity.data(), connectivity.size());  // gaps between types are kept, too
  const UploadsEnd uploads_end_first(executor);
  executor.start_uploads();
  job.elements = upload_elements(executor, topology, std::move(connectivity), preparation.chunks);
  TopologyView unmasked = topology;
  unmasked.fixed = {};
  BallPlan plan = BallPlan::of(size_of(topology), plan_job({}));
  const auto search = [&](bool keep_balls) {
    order_job(executor, job, preparation);
    plan.kept = keep_balls;
    find_topology(executor, unmasked, plan, true, control, job, preparation,
                  [&] { validate(topology); });
  };
  executor.clear(job.given.data(), node_count);  // all in one place: in the caller's order
  search(false);
  preparation.balls = {};
  place_by_edges(executor, node_count, job.rings.view(), job.given.data());
  executor.check();
  search(true);

  auto result = std::make_shared<CudaPreparedTopology>(executor.lane().device());
  result->topology = topology;
  if (position_count(reference) > 0) {
    result->reference = reference;
    result->kept = std::make_unique<KeptReference<CudaExecutor>>(
        kept_system_bytes(count_mesh(size_of(topology))));
  }
  // However this ends, the copies end before what they fill is freed.
  const auto wait = [](CudaExecutor* of) { cudaStreamSynchronize(of->lane().stream.get()); };
  const std::unique_ptr<CudaExecutor, decltype(wait)> copies_end_first(&executor, wait);
  const PrepareState& found = preparation.found(executor);
  result->boundary_nodes = static_cast<std::int64_t>(found.boundary);
  const auto keep_some = [&](const auto& buffer, std::size_t size) {
    return keep(executor, *result->memory, result->count, buffer, size);
  };
  const auto keep_all = [&](const auto& buffer) { return keep_some(buffer, buffer.size()); };
  result->caller_ids = keep_all(job.caller_ids);
  result->elements.view = job.elements.view;
  result->elements.dimension = job.elements.dimension;
  result->elements.connectivity = keep_all(job.elements.connectivity);
  result->elements.caller_ids = keep_all(job.elements.caller_ids);
  for (int r = 0; r < job.elements.view.run_count; ++r) {
    Elements::Run& run = result->elements.view.runs[r];
    run.shape = element_table().data() + (run.shape - executor.lane().shapes());
    run.nodes =
        result->elements.connectivity.data() + (run.nodes - job.elements.connectivity.data());
  }
  std::size_t entry_count = 0;
  for (const ElementBlockView& block : topology.blocks) entry_count += block.nodes.size();
  result->balls = {keep_all(job.balls.offsets), keep_some(job.balls.entries, entry_count)};
  result->rings = {keep_all(job.rings.offsets),
                   keep_some(job.rings.entries, static_cast<std::size_t>(found.ring_entries))};
  // Of nodes in no element the search says that they are fixed, too.
  std::uint8_t* const marks = job.fixed.data();
  const Rows<NodeId> rings = job.rings.view();
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    if (rings.size(node) == 0) marks[node] = 0;
  });
  result->on_boundary = keep_all(job.fixed);
  if (result->kept) {
    std::visit(
        [&]<class Real>(std::span<const Vec3<Real>> positions) {
          const auto given = executor.in_executor_memory(positions);
          result->reference_positions = keep_all(given);
          executor.synchronize();
        },
        reference);
  }
  executor.finish();
  return result;
}

/// The elements for a job of a lane: each lane has its own shapes.
[[nodiscard]] inline JobElements<CudaExecutor> borrow_elements(CudaExecutor& executor,
                                                               const CudaPreparedTopology& of) {
  JobElements<CudaExecutor> elements{of.elements.view, of.elements.dimension,
                                     of.elements.connectivity.borrow(),
                                     of.elements.caller_ids.borrow()};
  for (int r = 0; r < elements.view.run_count; ++r) {
    Elements::Run& run = elements.view.runs[r];
    run.shape = executor.lane().shapes() + (run.shape - element_table().data());
  }
  return elements;
}

/// What a job on a prepared topology finds of its positions and fixed nodes.
struct PlacedNodes {
  Vec3d lower{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Vec3d upper{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  std::int64_t boundary = 0, fixed = 0, isolated = 0, on_non_manifold_edges = 0, free = 0;
  std::int64_t not_finite = 0;

  friend MESHSMOOTH_HD PlacedNodes operator+(const PlacedNodes& a, const PlacedNodes& b) {
    const auto low = [](double x, double y) { return x < y ? x : y; };
    const auto high = [](double x, double y) { return x > y ? x : y; };
    return {{low(a.lower.x, b.lower.x), low(a.lower.y, b.lower.y), low(a.lower.z, b.lower.z)},
            {high(a.upper.x, b.upper.x), high(a.upper.y, b.upper.y), high(a.upper.z, b.upper.z)},
            a.boundary + b.boundary,
            a.fixed + b.fixed,
            a.isolated + b.isolated,
            a.on_non_manifold_edges + b.on_non_manifold_edges,
            a.free + b.free,
            a.not_finite + b.not_finite};
  }
};

/// `prepare_job` on a prepared topology; of `topology` it reads the fixed nodes. The host waits
/// once.
template <class Real>
JobMesh<CudaExecutor, Real> prepare_job(CudaExecutor& executor,
                                        const CudaPreparedTopology& prepared,
                                        const TopologyView& topology,
                                        std::span<const Vec3<Real>> positions, const JobPlan& plan,
                                        const JobControl& control, StageTimes& times) {
  const std::size_t node_count = topology.node_count;
  executor.bytes().enter(JobStage::find_boundary);
  JobMesh<CudaExecutor, Real> job;
  job.node_count = node_count;
  job.caller_ids = prepared.caller_ids.borrow();
  job.elements = borrow_elements(executor, prepared);
  job.balls = {prepared.balls.offsets.borrow(), prepared.balls.entries.borrow()};
  job.rings = {prepared.rings.offsets.borrow(), prepared.rings.entries.borrow()};
  DeviceBuffer<std::uint8_t> mask;
  {
    const StageTimer timer(executor, times.upload_seconds, control, Stage::find_neighbours);
    if (is_same_array(prepared.reference, positions)) {
      const auto& kept = std::get<DeviceBuffer<Vec3<Real>>>(prepared.reference_positions);
      job.given = executor.allocate<Vec3<Real>>(node_count);
      executor.copy(kept.data(), node_count, job.given.data());
    } else {
      job.given = executor.in_executor_memory(positions);
    }
    mask = executor.in_executor_memory(topology.fixed);
  }
  const StageTimer timer(executor, times.find_boundary_seconds, control, Stage::find_boundary);
  job.positions = executor.allocate<Vec3<Real>>(node_count);
  job.fixed = executor.allocate<std::uint8_t>(node_count);
  const FixRule rule{job.caller_ids.data(), topology.fixed.empty() ? nullptr : mask.data(),
                     plan.options.boundary != BoundaryPolicy::free, job.fixed.data()};
  const std::uint8_t* const on_boundary = prepared.on_boundary.data();
  const Rows<NodeId> rings = job.rings.view();
  const Vec3<Real>* const given = job.given.data();
  Vec3<Real>* const ordered = job.positions.data();
  const PlacedNodes found = executor.reduce(
      node_count, PlacedNodes{},
      [=] __device__(std::size_t node) {
        const Vec3<Real> p = given[rule.caller_ids[node]];
        ordered[node] = p;
        rule.fixed[node] = on_boundary[node];
        const FixedCounts counts = rule(node, rings.size(node) == 0);
        const Vec3d at = vec3_cast<double>(p);
        const bool finite = isfinite(at.x) && isfinite(at.y) && isfinite(at.z);
        return PlacedNodes{at,
                           at,
                           counts.nodes.boundary,
                           counts.nodes.fixed,
                           counts.nodes.isolated,
                           counts.nodes.on_non_manifold_edges,
                           counts.free,
                           finite ? 0 : 1};
      },
      Plus{});
  if (found.not_finite > 0) {
    validate_positions(topology, std::span<const Vec3<Real>>(executor.to_host(job.given)));
    throw DeviceError("DEVICE_LOST", "the device rejects a mesh that the host finds valid", true);
  }
  job.box = {found.lower, found.upper};
  job.nodes.total = static_cast<std::int64_t>(node_count);
  job.nodes.boundary = found.boundary;
  job.nodes.fixed = found.fixed;
  job.nodes.isolated = found.isolated;
  job.nodes.on_non_manifold_edges = found.on_non_manifold_edges;
  job.free_count = static_cast<std::size_t>(found.free);
  return job;
}

}  // namespace meshsmooth::detail

#pragma once

#include <functional>
#include <span>

#include "smooth/cuda/topology/ball_plan.hpp"
#include "smooth/cuda/topology/node_order.cuh"
#include "smooth/cuda/topology/row_builder.cuh"
#include "smooth/steps/job_mesh.hpp"
#include "smooth/steps/mesh_counts.hpp"
#include "smooth/steps/refusals.hpp"

namespace meshsmooth::detail {

/// Where an entry of the balls goes in its row is what the row's counter held;
/// what does not fit a byte is given a place from the row's end.
inline constexpr std::uint8_t kLatePlace = 255;

/// Adds 1 to counter[node]; threads of a warp with the same node do it by one
/// atomic addition. Neighbouring elements share nodes, and what limits the count
/// are atomics.
__device__ inline std::uint32_t add_together(std::uint32_t* counters, NodeId node) {
  const unsigned int active = __activemask();
  const unsigned int same = __match_any_sync(active, node);
  const unsigned int lane = threadIdx.x % kWarp;
  const int leader = __ffs(static_cast<int>(same)) - 1;
  std::uint32_t place = 0;
  if (static_cast<int>(lane) == leader) {
    place = atomicAdd(&counters[node], static_cast<std::uint32_t>(__popc(same)));
  }
  return __shfl_sync(same, place, leader) +
         static_cast<std::uint32_t>(__popc(same & ((1U << lane) - 1)));
}

/// Keeps where in the rows of its nodes an element is counted.
struct KeepPlaces {
  std::uint8_t* places;

  template <int kWidth>
  __device__ void operator()(std::size_t e, const NodeId (&)[kWidth],
                             const std::uint32_t (&row_places)[kWidth]) const {
    std::uint8_t bytes[kWidth];
#pragma unroll
    for (int n = 0; n < kWidth; ++n) {
      bytes[n] = static_cast<std::uint8_t>(row_places[n] < kLatePlace ? row_places[n] : kLatePlace);
    }
    store_group(bytes, places + e * kWidth);
  }
};
/// Puts an element into its nodes' balls at once.
struct KeepInSlots {
  BallSlots slots;
  std::size_t first_id;
  PrepareState* state;

  template <int kWidth>
  __device__ void operator()(std::size_t e, const NodeId (&nodes)[kWidth],
                             const std::uint32_t (&row_places)[kWidth]) const {
#pragma unroll
    for (int n = 0; n < kWidth; ++n) {
      if (row_places[n] < BallSlots::kCount) {
        slots.row(static_cast<std::size_t>(nodes[n]))[row_places[n] * kWarp] =
            static_cast<ElementId>(first_id + e);
      } else {
        state->overfull_ball = 1;
      }
    }
  }
};

/// Takes the elements of one type into internal numbers, in place (null: they have them), and
/// counts the balls' entries. A wrong element becomes one that does no harm, and is
/// reported. Places in a row are given in any order: rows are sorted where order
/// matters.
template <int kWidth, class Keep>
void count_entries(CudaExecutor& executor, std::size_t node_count, std::size_t count,
                   NodeId* connectivity, const NodeId* internal_of, std::uint32_t* sizes,
                   const Keep& keep, PrepareState* state) {
  executor.for_each(count, [=] __device__(std::size_t e) {
    NodeId nodes[kWidth];
    load_group(connectivity + e * kWidth, nodes);
    if (internal_of != nullptr) {
      bool right = true;
#pragma unroll
      for (int n = 0; n < kWidth; ++n) {
        right &= nodes[n] >= 0 && static_cast<std::size_t>(nodes[n]) < node_count;
#pragma unroll
        for (int earlier = 0; earlier < n; ++earlier) right &= nodes[earlier] != nodes[n];
      }
      if (!right) state->wrong_element = 1;
#pragma unroll
      for (int n = 0; n < kWidth; ++n) nodes[n] = right ? internal_of[nodes[n]] : 0;
      store_group(nodes, connectivity + e * kWidth);
    }
    std::uint32_t row_places[kWidth];
#pragma unroll
    for (int n = 0; n < kWidth; ++n) row_places[n] = add_together(sizes, nodes[n]);
    keep(e, nodes, row_places);
  });
}

template <int kWidth>
void fill_balls(CudaExecutor& executor, std::size_t count, std::size_t first_id,
                const NodeId* connectivity, const std::uint8_t* places, std::uint32_t* sizes,
                const std::int64_t* offsets, ElementId* entries) {
  executor.for_each(count, [=] __device__(std::size_t e) {
    NodeId nodes[kWidth];
    std::uint8_t row_places[kWidth];
    load_group(connectivity + e * kWidth, nodes);
    load_group(places + e * kWidth, row_places);
    std::int64_t starts[kWidth];
#pragma unroll
    for (int n = 0; n < kWidth; ++n) starts[n] = offsets[nodes[n]];
#pragma unroll
    for (int n = 0; n < kWidth; ++n) {
      std::uint32_t place = row_places[n];
      if (place == kLatePlace) place = atomicSub(&sizes[nodes[n]], 1U) - 1;
      entries[starts[n] + place] = static_cast<ElementId>(first_id + e);
    }
  });
}

/// Calls `body.operator()<nodes per element>()` for a type.
template <class Body>
void with_width(int node_count, const Body& body) {
  switch (node_count) {
    case 3:
      return body.template operator()<3>();
    case 4:
      return body.template operator()<4>();
    case 5:
      return body.template operator()<5>();
    case 6:
      return body.template operator()<6>();
    default:
      return body.template operator()<8>();
  }
}

/// Ids between which runs of elements may begin.
inline constexpr std::ptrdiff_t kRunAlignment = 4;

/// A stretch of the connectivity that goes up at one go.
struct UploadedPiece {
  NodeId* nodes;
  std::size_t element_count;
  int width;
  std::size_t arrival;  // a mark in the stream of uploads
};
/// Elements of the next piece, of so many that are left. Each is counted while those behind it are
/// on their way, 2.5 times as fast as they come; that of the last nothing hides, so it is small.
/// They are few, for each costs 5 us (H200).
[[nodiscard]] inline std::size_t piece_size(std::size_t left) {
  std::size_t last = std::size_t{1} << 16, behind = 0;
  while (behind + last < left) {
    behind += last;
    last = last * 5 / 2;
  }
  return left - behind;
}

/// Room for the caller's elements, grouped by type.
inline DeviceBuffer<NodeId> allocate_connectivity(CudaExecutor& executor,
                                                  const TopologyView& topology) {
  std::size_t size = 0;
  for (const ElementBlockView& block : topology.blocks) size += block.nodes.size();
  return executor.allocate<NodeId>(size + kElementTypeCount * kRunAlignment);
}

/// The caller's elements on the device, grouped by type and inside a type in the
/// caller's order, still in the caller's numbers. The copies run in the stream of
/// uploads, piece by piece.
inline JobElements<CudaExecutor> upload_elements(CudaExecutor& executor,
                                                 const TopologyView& topology,
                                                 DeviceBuffer<NodeId> connectivity,
                                                 std::vector<UploadedPiece>& pieces) {
  JobElements<CudaExecutor> elements;
  elements.dimension = element_shape(topology.blocks.front().type).dimension;
  elements.connectivity = std::move(connectivity);
  NodeId* next = elements.connectivity.data();
  bool in_order = true;  // the caller's elements already lie type by type
  int last_type = -1;
  for (const ElementBlockView& block : topology.blocks) {
    if (block.element_count() == 0) continue;
    in_order &= static_cast<int>(block.type) >= last_type;
    last_type = static_cast<int>(block.type);
  }
  if (!in_order) elements.caller_ids = executor.allocate<ElementId>(topology.element_count());

  for (const ElementType type : kElementTypes) {
    const std::size_t first = elements.view.count;
    std::size_t left = 0;
    for (const ElementBlockView& block : topology.blocks) {
      if (block.type == type) left += block.element_count();
    }
    std::size_t piece = piece_size(left);
    NodeId* const begin = next;
    const auto width = static_cast<std::size_t>(element_shape(type).node_count);
    UploadedPiece open{begin, 0, static_cast<int>(width), 0};
    const auto close = [&] {
      open.arrival = executor.mark(executor.lane().uploads);
      pieces.push_back(open);
      left -= open.element_count;
      piece = piece_size(left);
      open = {open.nodes + open.element_count * width, 0, open.width, 0};
    };
    std::size_t first_caller = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const std::size_t count = block.element_count();
      if (block.type == type && count > 0) {
        for (std::size_t done = 0; done < count;) {
          const std::size_t part = std::min(piece - open.element_count, count - done);
          executor.upload_early(&block.nodes[done * width], part * width, next + done * width);
          done += part;
          open.element_count += part;
          if (open.element_count == piece) close();
        }
        if (!in_order) {
          ElementId* const caller_ids = elements.caller_ids.data() + elements.view.count;
          executor.for_each(count, [=] __device__(std::size_t e) {
            caller_ids[e] = static_cast<ElementId>(first_caller + e);
          });
        }
        next += block.nodes.size();
        elements.view.count += count;
      }
      first_caller += count;
    }
    if (elements.view.count == first) continue;
    next += (begin - next) & (kRunAlignment - 1);
    elements.view.runs[elements.view.run_count++] = {
        executor.lane().shapes() + static_cast<std::size_t>(type), begin, first};
  }
  return elements;
}

/// Calls `body.operator()<width>(run, its element count)` for every type.
template <class Body>
void for_each_run(CudaExecutor& executor, const JobElements<CudaExecutor>& elements,
                  const Body& body) {
  for (int r = 0; r < elements.view.run_count; ++r) {
    const Elements::Run& run = elements.view.runs[r];
    const std::size_t end =
        r + 1 < elements.view.run_count ? elements.view.runs[r + 1].first : elements.view.count;
    const auto type = static_cast<std::size_t>(run.shape - executor.lane().shapes());
    with_width(element_table()[type].node_count,
               [&]<int kWidth>() { body.template operator()<kWidth>(run, end - run.first); });
  }
}

/// The balls of a job, in slots or in rows.
struct FoundBalls {
  DeviceBuffer<std::uint32_t> sizes;
  DeviceBuffer<ElementId> slots;
  RowBuffer<CudaExecutor, ElementId> rows;  // with slots: what they need, to be filled

  [[nodiscard]] BallSlots in_slots() {
    return slots.size() == 0 ? BallSlots{} : BallSlots{slots.data(), sizes.data()};
  }
};

/// The balls, and the elements in internal numbers. `sizes` has a 0 for every node
/// and one more.
inline FoundBalls find_balls(CudaExecutor& executor, std::size_t node_count,
                             JobElements<CudaExecutor>& elements, const BallPlan& plan,
                             const NodeId* internal_of, DeviceBuffer<std::uint32_t> sizes,
                             const std::vector<UploadedPiece>& pieces, PrepareState* state) {
  const std::size_t entry_count = elements.connectivity.size();
  NodeId* const connectivity = elements.connectivity.data();
  FoundBalls found;
  found.sizes = std::move(sizes);
  DeviceBuffer<std::uint8_t> places;
  if (plan.slotted) {
    found.slots = executor.allocate<ElementId>(BallSlots::size(node_count));
  } else {
    places = executor.allocate<std::uint8_t>(entry_count);
  }
  for (const UploadedPiece& piece : pieces) {
    executor.await(piece.arrival);
    const auto first = static_cast<std::size_t>(piece.nodes - connectivity);
    with_width(piece.width, [&]<int kWidth>() {
      const auto count = [&](const auto& keep) {
        count_entries<kWidth>(executor, node_count, piece.element_count, piece.nodes, internal_of,
                              found.sizes.data(), keep, state);
      };
      if (plan.slotted) {
        count(KeepInSlots{found.in_slots(), first / kWidth, state});
      } else {
        count(KeepPlaces{places.data() + first});
      }
    });
  }
  if (plan.slotted && !plan.kept) return found;

  RowBuffer<CudaExecutor, ElementId>& rows = found.rows;
  rows.offsets = executor.allocate<std::int64_t>(node_count + 1);
  executor.with_workspace([&](void* space, std::size_t& bytes) {
    return cub::DeviceScan::ExclusiveScan(space, bytes, found.sizes.data(), rows.offsets.data(),
                                          std::plus<>(), std::int64_t{0}, node_count + 1,
                                          executor.stream());
  });
  rows.entries = executor.allocate<ElementId>(entry_count);
  if (plan.slotted) return found;
  for_each_run(executor, elements, [&]<int kWidth>(const Elements::Run& run, std::size_t count) {
    const std::size_t first = static_cast<std::size_t>(run.nodes - connectivity);
    fill_balls<kWidth>(executor, count, run.first, connectivity + first, places.data() + first,
                       found.sizes.data(), rows.offsets.data(), rows.entries.data());
  });
  found.sizes = {};
  return found;
}

/// Launches the search for rings and boundary, room for `capacity` entries, and what decides which
/// nodes stay: `hold.fixed` must be all 0, and nothing counted in the state. What has become of
/// that lies in the lane's mapped memory at the next `synchronize`.
inline RowBuffer<CudaExecutor, NodeId> find_rows(CudaExecutor& executor, std::size_t node_count,
                                                 const JobElements<CudaExecutor>& elements,
                                                 FoundBalls& balls, bool keep_balls,
                                                 std::size_t capacity, const FixRule& hold,
                                                 PrepareState* state) {
  const std::size_t blocks = (node_count + kRowsPerBlock - 1) / kRowsPerBlock;
  RowBuffer<CudaExecutor, NodeId> rings;
  rings.offsets = executor.allocate<std::int64_t>(node_count + 1);
  rings.entries = executor.allocate<NodeId>(capacity);
  auto words = executor.allocate<unsigned long long>(blocks);
  executor.clear(words.data(), blocks);
  const RowTask task{node_count,
                     elements.view,
                     balls.in_slots(),
                     balls.rows.offsets.data(),
                     balls.rows.entries.data(),
                     hold.caller_ids,
                     elements.caller_ids.data(),
                     keep_balls,
                     rings.offsets.data(),
                     rings.entries.data(),
                     capacity,
                     hold,
                     words.data(),
                     state,
                     executor.lane().mapped<PrepareState>(CudaExecutor::kStateOffset)};
  const auto grid = static_cast<unsigned int>(blocks);
  const auto is_only = [&](ElementType type) {
    return elements.view.run_count == 1 && node_count < kManyKeys &&
           elements.view.runs[0].shape == executor.lane().shapes() + static_cast<int>(type);
  };
  if (is_only(ElementType::tetrahedron)) {
    constexpr int kMany = 6;
    if (blocks <= kMany * static_cast<std::size_t>(executor.lane().multiprocessor_count())) {
      executor.launch_blocks<&row_kernel<4, kMany>>(grid, kRowsPerBlock, task);
    } else {
      executor.launch_blocks<&row_kernel<4>>(grid, kRowsPerBlock, task);
    }
  } else if (is_only(ElementType::triangle)) {
    executor.launch_blocks<&row_kernel<3>>(grid, kRowsPerBlock, task);
  } else {
    executor.launch_blocks<&row_kernel<0>>(grid, kRowsPerBlock, task);
  }
  return rings;
}

/// When it goes, what comes later in the stream waits for the uploads.
class UploadsEnd {
 public:
  explicit UploadsEnd(CudaExecutor& executor) : executor_(executor) {}
  ~UploadsEnd() {
    try {
      executor_.await_uploads();
    } catch (...) {  // the device is lost: nothing is copied any more
    }
  }
  UploadsEnd(const UploadsEnd&) = delete;
  UploadsEnd& operator=(const UploadsEnd&) = delete;

 private:
  CudaExecutor& executor_;
};

/// Steps 1 and 2 on the device: copies beside kernels, one wait at the end. What
/// is wrong with the mesh is noticed on the way and then named by the host.
template <class Real>
JobMesh<CudaExecutor, Real> prepare_job(CudaExecutor& executor, const TopologyView& topology,
                                        std::span<const Vec3<Real>> positions,
                                        const SmoothOptions& options, const JobControl& control,
                                        StageTimes& times) {
  if (control.on_progress) control.on_progress({Stage::find_neighbours, 0, 0, 0});
  const std::size_t node_count = topology.node_count;
  CudaLane& lane = executor.lane();
  JobMesh<CudaExecutor, Real> job;
  job.node_count = node_count;
  job.given = executor.allocate<Vec3<Real>>(node_count);
  auto mask = executor.allocate<std::uint8_t>(topology.fixed.size());
  auto connectivity = allocate_connectivity(executor, topology);
  // Whatever ends this: memory must not go while something is copied into it.
  const UploadsEnd uploads_end_first(executor);
  executor.start_uploads();
  const std::size_t uploads_begin = executor.mark(lane.uploads);
  executor.upload_early(positions.data(), node_count, job.given.data());
  executor.await_uploads();
  executor.upload_early(topology.fixed.data(), topology.fixed.size(), mask.data());
  std::vector<UploadedPiece> pieces;
  job.elements = upload_elements(executor, topology, std::move(connectivity), pieces);
  const std::size_t uploads_end = executor.mark(lane.uploads);
  executor.add_stretch(uploads_begin, uploads_end, times.upload_seconds);

  job.places = executor.allocate<Vec3<Real>>(node_count);
  job.fixed = executor.allocate<std::uint8_t>(node_count);
  auto state_buffer = executor.allocate<PrepareState>(1);
  PrepareState* const state = state_buffer.data();
  executor.clear(state, 1);
  job.caller_ids = executor.allocate<NodeId>(node_count);
  auto internal_of = executor.allocate<NodeId>(node_count);
  auto ball_sizes = executor.allocate<std::uint32_t>(node_count + 1);
  order_nodes(
      executor,
      NodeOrder<Real>{node_count, job.given.data(), job.caller_ids.data(), internal_of.data(),
                      job.places.data(), job.fixed.data(), ball_sizes.data()},
      state);

  const MeshSize size = size_of(topology);
  BallPlan plan = BallPlan::of(size, options);
  FoundBalls balls = find_balls(executor, node_count, job.elements, plan, internal_of.data(),
                                std::move(ball_sizes), pieces, state);
  internal_of = {};
  PrepareState* const seen = lane.template mapped<PrepareState>(CudaExecutor::kStateOffset);
  const FixRule hold{job.caller_ids.data(), topology.fixed.empty() ? nullptr : mask.data(),
                     options.boundary != BoundaryPolicy::free, job.fixed.data()};
  std::size_t rows_end = 0;
  for (std::size_t capacity = ring_entry_estimate(size);;
       capacity = std::max<std::size_t>(capacity, seen->ring_entries)) {
    job.rings = {};
    job.rings =
        find_rows(executor, node_count, job.elements, balls, plan.kept, capacity, hold, state);
    rows_end = executor.mark(lane.stream);
    if (control.on_progress) control.on_progress({Stage::find_boundary, 0, 0, 0});
    executor.synchronize();
    executor.check();
    if (seen->wrong_position != 0 || seen->wrong_element != 0) {
      validate(topology, positions);
      throw DeviceError("DEVICE_LOST", "the device finds a mesh wrong that the host finds right",
                        true);
    }
    const bool overfull = seen->overfull_ball != 0;
    if (!overfull && seen->overused_facet != 0) throw_overused_facet(topology);
    if (!overfull && seen->ring_entries <= capacity) break;
    executor.clear(job.fixed.data(), node_count);
    PrepareState again{};
    std::ranges::copy(seen->lower, again.lower);
    std::ranges::copy(seen->upper, again.upper);
    executor.upload(&again, 1, state);
    if (overfull) {
      plan.slotted = false;
      ball_sizes = std::move(balls.sizes);
      balls = {};
      executor.clear(ball_sizes.data(), ball_sizes.size());
      balls = find_balls(executor, node_count, job.elements, plan, nullptr, std::move(ball_sizes),
                         pieces, state);
    }
  }
  if (plan.kept) job.balls = std::move(balls.rows);
  executor.add_stretch(uploads_end, rows_end, times.find_neighbours_seconds);
  executor.add_stretch(rows_end, executor.mark(lane.stream), times.find_boundary_seconds);
  job.box = box_of(*seen);
  job.nodes.total = static_cast<std::int64_t>(node_count);
  job.nodes.boundary = static_cast<std::int64_t>(seen->boundary);
  job.nodes.fixed = static_cast<std::int64_t>(seen->held);
  job.nodes.isolated = static_cast<std::int64_t>(seen->isolated);
  job.free_count = static_cast<std::size_t>(seen->free);
  return job;
}

}  // namespace meshsmooth::detail

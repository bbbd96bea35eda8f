#pragma once

#include <vector>

#include "smooth/cuda/topology/element_runs.cuh"

namespace meshsmooth::detail {

/// Runs of elements begin at multiples of this many ids, for `load_group`.
inline constexpr std::ptrdiff_t kRunAlignment = 4;

/// A part of the connectivity that is copied at once.
struct UploadedChunk {
  NodeId* nodes;
  std::size_t element_count;
  ElementType type;
  std::size_t arrival;  // a mark in the stream of uploads
};
/// Elements of the next chunk, if `left` are left. Counting a chunk overlaps with the copies of the
/// later ones and is 2.5 times as fast, so that each chunk is 2.5 times as large as the next. The
/// last one is exposed, hence small. Few chunks: each costs 5 us (100k: neighbours 98 to 94 us,
/// H200).
[[nodiscard]] inline std::size_t chunk_size(std::size_t left) {
  std::size_t last = std::size_t{1} << 16, later = 0;
  while (later + last < left) {
    later += last;
    last = last * 5 / 2;
  }
  return left - later;
}

/// Room for the caller's elements, grouped by type.
inline DeviceBuffer<NodeId> allocate_connectivity(CudaExecutor& executor,
                                                  const TopologyView& topology) {
  std::size_t size = 0;
  for (const ElementBlockView& block : topology.blocks) size += block.nodes.size();
  return executor.allocate<NodeId>(size + kLinearTypeCount * kRunAlignment);
}

/// Uploads one run: the elements of one type, in chunks. The copies are queued when `add` is called
/// and a chunk is listed once it is complete.
class RunUpload {
 public:
  RunUpload(CudaExecutor& executor, ElementType type, std::size_t element_count, NodeId* to,
            std::vector<UploadedChunk>& chunks)
      : executor_(executor),
        width_(element_width(type)),
        left_(element_count),
        size_(chunk_size(element_count)),
        open_{to, 0, type, 0},
        chunks_(chunks) {}

  void add(const ElementBlockView& block) {
    const std::size_t count = block.element_count();
    for (std::size_t done = 0; done < count;) {
      const std::size_t part = std::min(size_ - open_.element_count, count - done);
      executor_.upload_early(&block.nodes[done * width_], part * width_,
                             open_.nodes + open_.element_count * width_);
      done += part;
      open_.element_count += part;
      if (open_.element_count == size_) close();
    }
  }

 private:
  void close() {
    open_.arrival = executor_.mark(executor_.lane().uploads);
    chunks_.push_back(open_);
    left_ -= open_.element_count;
    size_ = chunk_size(left_);
    open_.nodes += open_.element_count * width_;
    open_.element_count = 0;
  }

  CudaExecutor& executor_;
  std::size_t width_, left_, size_;
  UploadedChunk open_;
  std::vector<UploadedChunk>& chunks_;
};

/// Whether the caller's blocks are already grouped by type, in the order of the types.
[[nodiscard]] inline bool grouped_by_type(const TopologyView& topology) {
  int last_type = -1;
  for (const ElementBlockView& block : topology.blocks) {
    if (block.element_count() == 0) continue;
    if (static_cast<int>(block.type) < last_type) return false;
    last_type = static_cast<int>(block.type);
  }
  return true;
}

/// Copies the caller's elements to the device in chunks, in the stream of uploads: grouped by type,
/// inside a type in the caller's order, still with the caller's node numbers.
inline JobElements<CudaExecutor> upload_elements(CudaExecutor& executor,
                                                 const TopologyView& topology,
                                                 DeviceBuffer<NodeId> connectivity,
                                                 std::vector<UploadedChunk>& chunks) {
  JobElements<CudaExecutor> elements;
  elements.dimension = element_shape(topology.blocks.front().type).dimension;
  elements.connectivity = std::move(connectivity);
  NodeId* next = elements.connectivity.data();
  const bool in_order = grouped_by_type(topology);
  if (!in_order) elements.caller_ids = executor.allocate<ElementId>(topology.element_count());

  for (const ElementType type : kLinearTypes) {
    const std::size_t first = elements.view.count;
    std::size_t run_size = 0;
    for (const ElementBlockView& block : topology.blocks) {
      if (block.type == type) run_size += block.element_count();
    }
    if (run_size == 0) continue;
    NodeId* const begin = next;
    RunUpload upload(executor, type, run_size, begin, chunks);
    std::size_t first_caller = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const std::size_t count = block.element_count();
      if (block.type == type && count > 0) {
        upload.add(block);
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
    next += (begin - next) & (kRunAlignment - 1);
    elements.view.runs[elements.view.run_count++] = {
        executor.lane().shapes() + static_cast<std::size_t>(type), begin, first};
    elements.view.tetrahedra = elements.view.run_count == 1 && type == ElementType::tetrahedron;
  }
  return elements;
}

/// In its destructor, later work in the main stream is made to wait for the uploads.
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

}  // namespace meshsmooth::detail

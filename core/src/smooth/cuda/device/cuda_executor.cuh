#pragma once

#include <cub/device/device_merge_sort.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"
#include "meshsmooth/vec3.hpp"
#include "smooth/cuda/device/device_memory.hpp"
#include "smooth/cuda/sweeps/patch_sizes.hpp"
#include "smooth/steps/executor.hpp"
#include "smooth/steps/interrupt.hpp"

namespace meshsmooth::detail {

inline constexpr unsigned int kBlockSize = 256;
inline constexpr int kWarp = 32;
inline constexpr int kWarpsPerBlock = kBlockSize / kWarp;
inline constexpr unsigned int kAllLanes = 0xffffffffU;

/// Blocks of kBlockSize that give every one of `count` items a thread, at most
/// `most`.
[[nodiscard]] inline unsigned int block_count(std::size_t count, std::size_t most = 1U << 20) {
  return static_cast<unsigned int>(
      std::clamp<std::size_t>((count + kBlockSize - 1) / kBlockSize, 1, most));
}

template <class Body>
__global__ void __launch_bounds__(kBlockSize) for_each_kernel(std::size_t count, Body body) {
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t i = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; i < count; i += step) {
    body(i);
  }
}

/// Folds one value per thread into thread 0's, by a fixed tree. All threads of
/// the block must call it; `shared` holds a value for each of the kThreads.
template <unsigned int kThreads = kBlockSize, class T, class Combine>
__device__ T reduce_block(T value, T* shared, const Combine& combine) {
  shared[threadIdx.x] = value;
  __syncthreads();
  for (unsigned int width = kThreads / 2; width > 0; width /= 2) {
    if (threadIdx.x < width) {
      shared[threadIdx.x] = combine(shared[threadIdx.x], shared[threadIdx.x + width]);
    }
    __syncthreads();
  }
  value = shared[0];
  __syncthreads();
  return value;
}

/// The grouping depends on the grid alone. The last block to finish folds what
/// the blocks have found; `ticket` must be 0 and is 0 again afterwards.
template <class T, class Body, class Combine>
__global__ void __launch_bounds__(kBlockSize)
    reduce_kernel(std::size_t count, T zero, Body body, Combine combine, T* partial,
                  unsigned int* ticket, T* result) {
  __shared__ alignas(T) unsigned char bytes[kBlockSize * sizeof(T)];
  __shared__ bool last;
  T* const shared = reinterpret_cast<T*>(bytes);
  T sum = zero;
  const std::size_t step = std::size_t{gridDim.x} * kBlockSize;
  for (std::size_t i = std::size_t{blockIdx.x} * kBlockSize + threadIdx.x; i < count; i += step) {
    sum = combine(sum, body(i));
  }
  sum = reduce_block(sum, shared, combine);
  if (threadIdx.x == 0) {
    partial[blockIdx.x] = sum;
    __threadfence();
    last = atomicAdd(ticket, 1U) + 1 == gridDim.x;
  }
  __syncthreads();
  if (!last) return;
  __threadfence();
  sum = zero;
  for (unsigned int b = threadIdx.x; b < gridDim.x; b += kBlockSize) {
    sum = combine(sum, partial[b]);
  }
  sum = reduce_block(sum, shared, combine);
  if (threadIdx.x == 0) {
    *result = sum;
    *ticket = 0;
  }
}

inline constexpr std::size_t kMostDevices = 64;  // of a process

template <class T>
struct alignas(4 * sizeof(T)) FourOf {
  T values[4];
};

/// What belongs to the nodes of an element. Runs of elements with four nodes are
/// aligned, so that theirs come by one access.
template <int kWidth, class T>
__device__ void load_group(const T* from, T (&to)[kWidth]) {
  if constexpr (kWidth == 4) {
    const auto four = *reinterpret_cast<const FourOf<T>*>(from);
#pragma unroll
    for (int n = 0; n < 4; ++n) to[n] = four.values[n];
  } else {
#pragma unroll
    for (int n = 0; n < kWidth; ++n) to[n] = from[n];
  }
}
template <int kWidth, class T>
__device__ void store_group(const T (&from)[kWidth], T* to) {
  if constexpr (kWidth == 4) {
    *reinterpret_cast<FourOf<T>*>(to) = {from[0], from[1], from[2], from[3]};
  } else {
#pragma unroll
    for (int n = 0; n < kWidth; ++n) to[n] = from[n];
  }
}

/// What a lane of the CUDA backend owns from job to job.
class CudaLane {
 public:
  explicit CudaLane(int device)
      : device_(device),
        pool_(stream, device, release_threshold(), slab_bytes()),
        shapes_(kElementTypeCount, {pool_, resident_}),
        ticket_(1, {pool_, resident_}) {
    int shared_bytes = 0;
    check_cuda(cudaDeviceGetAttribute(&patch_limits_.multiprocessors,
                                      cudaDevAttrMultiProcessorCount, device),
               "asking for a device's properties");
    check_cuda(
        cudaDeviceGetAttribute(&shared_bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device),
        "asking for a device's properties");
    constexpr int kStaticBytes = 256;  // that a kernel declares beside
    patch_limits_.shared_bytes = static_cast<std::size_t>(shared_bytes - kStaticBytes);
    check_cuda(cudaMemcpyAsync(shapes_.data(), element_table().data(),
                               kElementTypeCount * sizeof(ElementShape), cudaMemcpyHostToDevice,
                               stream.get()),
               "copying to the device");
    check_cuda(cudaMemsetAsync(ticket_.data(), 0, sizeof(unsigned int), stream.get()),
               "clearing device memory");
    stream.synchronize();
  }

  Stream stream;   // everything runs here …
  Stream uploads;  // … but copies that need not wait for it
  Event ordering{cudaEventDisableTiming};
  std::vector<Event> events;

  [[nodiscard]] int device() const { return device_; }
  [[nodiscard]] int multiprocessor_count() const { return patch_limits_.multiprocessors; }
  [[nodiscard]] const PatchLimits& patch_limits() const { return patch_limits_; }
  [[nodiscard]] DevicePool& pool() { return pool_; }
  [[nodiscard]] const DevicePool& pool() const { return pool_; }
  /// The element table.
  [[nodiscard]] const ElementShape* shapes() const { return shapes_.data(); }
  /// Of `reduce_kernel`.
  [[nodiscard]] unsigned int* ticket() { return ticket_.data(); }

  /// Host memory that kernels write to, kMappedBytes of it from `offset` on.
  template <class T>
  [[nodiscard]] T* mapped(std::size_t offset) const {
    return reinterpret_cast<T*>(mapped_.data() + offset);
  }
  static constexpr std::size_t kMappedBytes = 1U << 16;

  /// Page-locked host memory to copy to: copies to other memory are made by the driver in parts
  /// of its own, one lane at a time. The next call may end what this one gives.
  [[nodiscard]] unsigned char* staging(std::size_t bytes) {
    if (bytes > staging_size_) {
      staging_.emplace(bytes);
      staging_size_ = bytes;
    }
    return staging_->data();
  }

 private:
  /// What a lane keeps between jobs.
  static std::size_t release_threshold() {
    std::size_t free = 0, total = 0;
    check_cuda(cudaMemGetInfo(&free, &total), "asking for a device's memory");
    return std::min<std::size_t>(std::size_t{2} << 30, total / 16);
  }
  /// compute-sanitizer knows the driver's allocations only: for its runs there is no slab.
  static std::size_t slab_bytes() {
    const bool plain = std::getenv("MESHSMOOTH_PLAIN_DEVICE_MEMORY") != nullptr;
    return plain ? 0 : std::min<std::size_t>(std::size_t{64} << 20, release_threshold() / 4);
  }

  int device_;
  PatchLimits patch_limits_;
  ByteCount resident_;
  DevicePool pool_;
  DeviceBuffer<ElementShape> shapes_;
  DeviceBuffer<unsigned int> ticket_;
  MappedBuffer<unsigned char> mapped_{kMappedBytes};
  std::optional<MappedBuffer<unsigned char>> staging_;
  std::size_t staging_size_ = 0;
};

/// Positions that others write at the same time (Form::asynchronous): each coordinate
/// is whole, a node may be a mixture of old and new.
template <class R>
struct CudaAsynchronousPositions {
  using Real = R;
  Vec3<R>* data;

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    const volatile Vec3<R>& p = data[node];
    return {p.x, p.y, p.z};
  }
  __device__ void store(std::size_t node, Vec3<R> place) const {
    volatile Vec3<R>& p = data[node];
    p.x = place.x;
    p.y = place.y;
    p.z = place.z;
  }
};

/// The executor of the CUDA backend: one job on one lane. Calls return when their
/// work is queued, those that give a value when it is done.
class CudaExecutor {
 public:
  template <class T>
  using Buffer = DeviceBuffer<T>;
  template <class T>
  using HostArray = DeviceBuffer<T>;
  template <class Real>
  using AsynchronousPositions = CudaAsynchronousPositions<Real>;
  static constexpr int kKeptCorners = 1;  // more would lie in memory anyway

  CudaExecutor(CudaLane& lane, const Interrupt& interrupt) : lane_(lane), interrupt_(interrupt) {}
  /// Nothing of the job may still run when its host memory goes.
  ~CudaExecutor() {
    cudaStreamSynchronize(lane_.uploads.get());
    cudaStreamSynchronize(lane_.stream.get());
  }
  CudaExecutor(const CudaExecutor&) = delete;
  CudaExecutor& operator=(const CudaExecutor&) = delete;

  /// To queue something.
  [[nodiscard]] cudaStream_t stream() {
    stream_end_.reset();
    return lane_.stream.get();
  }
  [[nodiscard]] CudaLane& lane() { return lane_; }
  [[nodiscard]] ByteCount& bytes() { return bytes_; }
  [[nodiscard]] const Interrupt& interrupt() const { return interrupt_; }

  template <class T>
  [[nodiscard]] Buffer<T> allocate(std::size_t size) {
    return Buffer<T>(size, {lane_.pool(), bytes_});
  }

  template <class T>
  [[nodiscard]] HostArray<T> in_executor_memory(std::span<const T> host) {
    HostArray<T> array = allocate<T>(host.size());
    upload(host.data(), host.size(), array.data());
    return array;
  }

  /// `host` must stay until the next `synchronize`, if it is pinned.
  template <class T>
  void upload(const T* host, std::size_t size, T* to) {
    if (size == 0) return;
    check_cuda(cudaMemcpyAsync(to, host, size * sizeof(T), cudaMemcpyHostToDevice, stream()),
               "copying to the device");
  }

  /// Copies that only wait for what is queued so far, and that nothing waits for
  /// but `await_uploads`: they run beside the kernels. `host` must stay.
  void start_uploads() {
    uploads_end_.reset();
    lane_.ordering.record(lane_.stream);
    lane_.ordering.hold_up(lane_.uploads);
  }
  template <class T>
  void upload_early(const T* host, std::size_t size, T* to) {
    if (size == 0) return;
    uploads_end_.reset();
    check_cuda(
        cudaMemcpyAsync(to, host, size * sizeof(T), cudaMemcpyHostToDevice, lane_.uploads.get()),
        "copying to the device");
  }
  void await_uploads() { await(mark(lane_.uploads)); }

  /// What comes later waits for a mark in another stream.
  void await(std::size_t mark) {
    if (awaited_ == mark) return;
    lane_.events[mark].hold_up(lane_.stream);
    stream_end_.reset();
    awaited_ = mark;
  }

  /// A copy that is there at the next `synchronize`.
  template <class T>
  void download_later(const T* from, T* host, std::size_t size = 1) {
    check_cuda(cudaMemcpyAsync(host, from, size * sizeof(T), cudaMemcpyDeviceToHost, stream()),
               "copying from the device");
  }

  template <class T>
  void clear(T* data, std::size_t size) {
    check_cuda(cudaMemsetAsync(data, 0, size * sizeof(T), stream()), "clearing device memory");
  }

  template <class T>
  void download(const T* from, std::size_t size, T* host) {
    if (size != 0) {
      check_cuda(cudaMemcpyAsync(host, from, size * sizeof(T), cudaMemcpyDeviceToHost, stream()),
                 "copying from the device");
    }
    synchronize();
  }

  template <class Body>
  void for_each(std::size_t count, const Body& body) {
    if (count == 0) return;
    launch<&for_each_kernel<Body>>(block_count(count), count, body);
  }

  template <class T, class Body, class Combine>
  [[nodiscard]] T reduce(std::size_t count, T zero, const Body& body, const Combine& combine) {
    if (count == 0) return zero;
    static_assert(sizeof(T) <= kResultBytes);
    T* const result = lane_.mapped<T>(0);
    reduce_later(count, zero, body, combine, result);
    synchronize();
    check();
    return *result;
  }
  /// `reduce` of at least one item, whose result is in mapped memory at the next `synchronize`.
  template <class T, class Body, class Combine>
  void reduce_later(std::size_t count, T zero, const Body& body, const Combine& combine,
                    T* result) {
    static_assert(std::is_trivially_copyable_v<T>);
    const unsigned int blocks = block_count(count, kReduceBlocks);
    auto partial = allocate<T>(blocks);
    launch<&reduce_kernel<T, Body, Combine>>(blocks, count, zero, body, combine, partial.data(),
                                             lane_.ticket(), result);
  }

  template <class T>
  T exclusive_scan(T* data, std::size_t count) {
    T last{}, before_last{};
    if (count == 0) return last;
    download(data + (count - 1), 1, &last);
    with_workspace([&](void* space, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(space, bytes, data, data, count, stream());
    });
    download(data + (count - 1), 1, &before_last);
    return before_last + last;
  }

  template <class Key>
  void sort(Key* keys, std::size_t count) {
    if constexpr (std::is_integral_v<Key>) {
      auto sorted = allocate<Key>(count);
      with_workspace([&](void* space, std::size_t& bytes) {
        return cub::DeviceRadixSort::SortKeys(space, bytes, keys, sorted.data(), count, 0,
                                              8 * sizeof(Key), stream());
      });
      check_cuda(cudaMemcpyAsync(keys, sorted.data(), count * sizeof(Key), cudaMemcpyDeviceToDevice,
                                 stream()),
                 "copying");
    } else {
      with_workspace([&](void* space, std::size_t& bytes) {
        return cub::DeviceMergeSort::SortKeys(space, bytes, keys, count, std::less<>(), stream());
      });
    }
    check();
  }

  template <class Key>
  [[nodiscard]] std::size_t unique(Key* keys, std::size_t count) {
    if (count == 0) return 0;
    auto result = allocate<std::int64_t>(1);
    auto kept = allocate<Key>(count);
    with_workspace([&](void* space, std::size_t& bytes) {
      return cub::DeviceSelect::Unique(space, bytes, keys, kept.data(), result.data(),
                                       static_cast<std::int64_t>(count), stream());
    });
    std::int64_t left = 0;
    download(result.data(), 1, &left);
    check_cuda(cudaMemcpyAsync(keys, kept.data(), static_cast<std::size_t>(left) * sizeof(Key),
                               cudaMemcpyDeviceToDevice, stream()),
               "copying");
    return static_cast<std::size_t>(left);
  }

  /// O(log count) copies from the device.
  template <class Key>
  [[nodiscard]] std::size_t lower_bound(const Key* keys, std::size_t count, Key value) {
    std::size_t low = 0;
    for (std::size_t high = count; low < high;) {
      const std::size_t middle = low + (high - low) / 2;
      Key key{};
      download(keys + middle, 1, &key);
      (key < value ? low : high) = key < value ? middle + 1 : middle;
    }
    return low;
  }

  /// Adds to a slot that several bodies share and returns what was there.
  class Adder {
   public:
    template <class T>
    __device__ T operator()(T& slot, T value) const {
      return atomicAdd(&slot, value);
    }
  };
  [[nodiscard]] Adder adder() const { return {}; }

  /// A store that other threads may make or read at the same time.
  template <class T>
  static __device__ void store(T& slot, T value) {
    static_cast<volatile T&>(slot) = value;
  }
  template <class T>
  static __device__ T load(T& slot) {
    return static_cast<volatile T&>(slot);
  }

  void synchronize() {
    lane_.stream.synchronize();
    stream_end_.reset();  // time has passed
  }
  /// Until the stream has come to a mark; what is queued behind it may still run.
  void wait_for(std::size_t mark) {
    lane_.events[mark].synchronize();
    stream_end_.reset();
  }
  void check() const { interrupt_.check(); }

  /// Runs a CUB call twice: for the size of its workspace, and with it.
  template <class Call>
  void with_workspace(const Call& call) {
    std::size_t size = 0;
    check_cuda(call(nullptr, size), "asking CUB for its workspace");
    auto space = allocate<unsigned char>(std::max<std::size_t>(size, 1));
    check_cuda(call(space.data(), size), "running CUB");
  }

  template <auto kKernel, class... Arguments>
  void launch(unsigned int blocks, const Arguments&... arguments) {
    launch_shared<kKernel>(blocks, 0, arguments...);
  }
  template <auto kKernel, class... Arguments>
  void launch_blocks(unsigned int blocks, unsigned int block_size, const Arguments&... arguments) {
    kKernel<<<blocks, block_size, 0, stream()>>>(arguments...);
    check_cuda(cudaGetLastError(), "launching a kernel");
  }
  template <auto kKernel, class... Arguments>
  void launch_shared(unsigned int blocks, std::size_t shared_bytes, const Arguments&... arguments) {
    kKernel<<<blocks, kBlockSize, shared_bytes, stream()>>>(arguments...);
    check_cuda(cudaGetLastError(), "launching a kernel");
  }

  /// Blocks for a kernel whose blocks wait for each other: `most`, or as many as the
  /// device holds at the same time. A kernel's blocks are always of one size.
  template <auto kKernel>
  [[nodiscard]] unsigned int cooperative_blocks(std::size_t most,
                                                unsigned int block_size = kBlockSize) {
    // Asked once for every device: 0 is not known yet.
    static std::array<std::atomic<int>, kMostDevices> known{};
    std::atomic<int>& per_multiprocessor = known.at(static_cast<std::size_t>(lane_.device()));
    if (per_multiprocessor == 0) {
      int blocks = 0;
      check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kKernel,
                                                               static_cast<int>(block_size), 0),
                 "asking for a kernel's occupancy");
      per_multiprocessor = std::max(blocks, 1);
    }
    const auto resident =
        static_cast<std::size_t>(per_multiprocessor.load() * lane_.multiprocessor_count());
    return static_cast<unsigned int>(std::clamp<std::size_t>(most, 1, resident));
  }
  /// Lets a kernel's blocks have more shared memory than any may, always as much.
  template <auto kKernel>
  void allow_shared_memory(std::size_t bytes) {
    static std::array<std::atomic<bool>, kMostDevices> done{};
    std::atomic<bool>& here = done.at(static_cast<std::size_t>(lane_.device()));
    if (here) return;
    check_cuda(cudaFuncSetAttribute(kKernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                    static_cast<int>(bytes)),
               "asking for shared memory");
    here = true;
  }
  template <auto kKernel, class... Arguments>
  void launch_cooperative(unsigned int blocks, unsigned int block_size, std::size_t shared_bytes,
                          Arguments... arguments) {
    void* pointers[] = {&arguments...};
    check_cuda(cudaLaunchCooperativeKernel(kKernel, dim3(blocks), dim3(block_size), pointers,
                                           shared_bytes, stream()),
               "launching a cooperative kernel");
  }

  /// A stretch of the stream whose time is known once the job is over.
  class Timer {
   public:
    Timer(CudaExecutor& executor, double& seconds) : executor_(executor) {
      executor.add_stretch(executor.mark(executor.lane_.stream), 0, seconds);
      index_ = executor.stretches_.size() - 1;
    }
    ~Timer() { executor_.stretches_[index_].end = executor_.mark_quietly(); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    CudaExecutor& executor_;
    std::size_t index_;
  };

  /// A point in a stream, by its number; and the time between two. One behind which nothing was
  /// queued stands for the next one too.
  std::size_t mark(const Stream& stream) {
    std::optional<std::size_t>& end = &stream == &lane_.uploads ? uploads_end_ : stream_end_;
    if (end) return *end;
    if (event_count_ == lane_.events.size()) lane_.events.emplace_back();
    lane_.events[event_count_].record(stream);
    end = event_count_++;
    return *end;
  }
  void add_stretch(std::size_t begin, std::size_t end, double& seconds) {
    stretches_.push_back({begin, end, &seconds});
  }

  /// Waits for all that is queued, and adds the times of all timers.
  void finish() {
    synchronize();
    for (const Stretch& s : stretches_) {
      *s.seconds += lane_.events[s.end].seconds_since(lane_.events[s.begin]);
    }
    stretches_.clear();
    event_count_ = 0;
    stream_end_ = uploads_end_ = awaited_ = std::nullopt;
  }

 private:
  static constexpr std::size_t kReduceBlocks = 1024;

 public:
  /// Where in the lane's mapped memory who writes.
  static constexpr std::size_t kResultBytes = 1U << 12, kStateOffset = kResultBytes,
                               kSweepsOffset = 2 * kResultBytes,
                               kMovedOffset = CudaLane::kMappedBytes - kResultBytes;

 private:
  struct Stretch {
    std::size_t begin, end;  // events
    double* seconds;
  };

  /// For destructors: an error shows up again at the next call.
  std::size_t mark_quietly() noexcept {
    try {
      return mark(lane_.stream);
    } catch (...) {
      return 0;
    }
  }

  CudaLane& lane_;
  const Interrupt& interrupt_;
  ByteCount bytes_;
  std::vector<Stretch> stretches_;
  std::size_t event_count_ = 0;
  std::optional<std::size_t> stream_end_, uploads_end_;  // marks with nothing behind them
  std::optional<std::size_t> awaited_;                   // the last of the other stream's
};

static_assert(Executor<CudaExecutor>);

}  // namespace meshsmooth::detail

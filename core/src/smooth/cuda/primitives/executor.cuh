#pragma once

#include <cub/device/device_scan.cuh>

#include <algorithm>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "meshsmooth/vec3.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/base/interrupt.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/cuda/base/launch.cuh"
#include "smooth/cuda/base/stream_marks.hpp"
#include "smooth/cuda/primitives/reduce.cuh"
#include "smooth/cuda/primitives/rounds.cuh"
#include "smooth/cuda/primitives/warp_team.cuh"

namespace meshsmooth::detail {

/// body(i) for all i below `count`, by a grid-stride loop over blocks of kBlockSize.
template <class Body>
__global__ void __launch_bounds__(kBlockSize) for_each_kernel(std::size_t count, Body body) {
  for_each_in_grid(count, body);
}

/// A body for rows, called by the threads of teams.
template <class Team, class Body>
struct RowBody {
  Body body;
  __device__ void operator()(std::size_t thread) const { body(thread / Team::size, Team()); }
};
template <class Team, class T, class Body>
struct RowValue {
  Body body;
  T zero;
  __device__ T operator()(std::size_t thread) const {
    const Team team;
    const T value = body(thread / Team::size, team);
    return team.rank == 0 ? value : zero;
  }
};

/// Positions for asynchronous relaxation (Form::asynchronous), which other threads write at the
/// same time: each coordinate is whole, a position may mix old and new.
template <class R>
struct CudaAsynchronousPositions {
  using Real = R;
  Vec3<R>* data;

  [[nodiscard]] __device__ Vec3<R> operator[](std::size_t node) const {
    const volatile Vec3<R>& p = data[node];
    return {p.x, p.y, p.z};
  }
  __device__ void store(std::size_t node, Vec3<R> position) const {
    volatile Vec3<R>& p = data[node];
    p.x = position.x;
    p.y = position.y;
    p.z = position.z;
  }
};

/// The executor of the CUDA backend: one job on one lane. Calls return when their work is queued,
/// those that return a value when it is done.
class CudaExecutor : public StreamMarks {
 public:
  template <class T>
  using Buffer = DeviceBuffer<T>;
  template <class T>
  using HostArray = DeviceBuffer<T>;
  template <class Real>
  using AsynchronousPositions = CudaAsynchronousPositions<Real>;
  using Thread = SingleThread;

  CudaExecutor(CudaLane& lane, const Interrupt& interrupt)
      : StreamMarks(lane), interrupt_(interrupt) {}
  /// Waits: no work of the job may outlive its host memory.
  ~CudaExecutor() {
    cudaStreamSynchronize(lane().uploads.get());
    cudaStreamSynchronize(lane().stream.get());
  }

  [[nodiscard]] ByteCount& bytes() { return bytes_; }
  [[nodiscard]] const Interrupt& interrupt() const { return interrupt_; }
  void check() const { interrupt_.check(); }

  /// Keeps something until all work of the job has ended.
  void hold(std::shared_ptr<const void> what) { held_.push_back(std::move(what)); }

  template <class T>
  [[nodiscard]] Buffer<T> allocate(std::size_t size) {
    return Buffer<T>(size, {lane().pool(), bytes_});
  }

  template <class T>
  [[nodiscard]] HostArray<T> in_executor_memory(std::span<const T> host) {
    HostArray<T> array = allocate<T>(host.size());
    upload(host.data(), host.size(), array.data());
    return array;
  }

  template <class T>
  [[nodiscard]] std::vector<T> to_host(const HostArray<T>& array) {
    std::vector<T> host(array.size());
    download(array.data(), host.size(), host.data());
    return host;
  }

  /// `host` must stay until the next `synchronize`, if it is page-locked.
  template <class T>
  void upload(const T* host, std::size_t size, T* to) {
    copy_up(host, size, to, stream());
  }
  /// In the stream of uploads, concurrent with kernels; `await_uploads` orders it. `host` must
  /// stay.
  template <class T>
  void upload_early(const T* host, std::size_t size, T* to) {
    copy_up(host, size, to, uploads());
  }
  /// Complete at the next `synchronize`.
  template <class T>
  void download_later(const T* from, T* host, std::size_t size = 1) {
    if (size == 0) return;
    check_cuda(cudaMemcpyAsync(host, from, size * sizeof(T), cudaMemcpyDeviceToHost, stream()),
               "copying from the device");
  }
  template <class T>
  void download(const T* from, std::size_t size, T* host) {
    download_later(from, host, size);
    synchronize();
  }
  template <class T>
  void copy(const T* from, std::size_t size, T* to) {
    if (size == 0) return;
    check_cuda(cudaMemcpyAsync(to, from, size * sizeof(T), cudaMemcpyDeviceToDevice, stream()),
               "copying on the device");
  }
  template <class T>
  void clear(T* data, std::size_t size) {
    check_cuda(cudaMemsetAsync(data, 0, size * sizeof(T), stream()), "clearing device memory");
  }

  template <class Body>
  void for_each(std::size_t count, const Body& body) {
    if (count == 0) return;
    launch<&for_each_kernel<Body>>(stream(), {block_count(count)}, count, body);
  }

  template <class T, class Body, class Combine>
  [[nodiscard]] T reduce(std::size_t count, T zero, const Body& body, const Combine& combine) {
    if (count == 0) return zero;
    static_assert(sizeof(T) <= CudaLane::kResultBytes);
    T* const result = lane().template mapped<T>(CudaLane::kResultOffset);
    reduce_later(count, zero, body, combine, result);
    synchronize();
    check();
    return *result;
  }
  /// `reduce` of at least one item; the result is in mapped memory at the next `synchronize`.
  template <class T, class Body, class Combine>
  void reduce_later(std::size_t count, T zero, const Body& body, const Combine& combine,
                    T* result) {
    static_assert(std::is_trivially_copyable_v<T>);
    constexpr std::size_t kMostBlocks = 1024;
    const unsigned int blocks = block_count(count, kMostBlocks);
    auto partial = allocate<T>(blocks);
    launch<&reduce_kernel<T, Body, Combine>>(stream(), {blocks}, count, zero, body, combine,
                                             partial.data(), lane().ticket(), result);
  }

  template <class T, class Body, class Combine>
  void reduce_to(std::size_t count, T zero, const Body& body, const Combine& combine, T* result) {
    reduce_later(count, zero, body, combine, result);
  }

  // A product with Laplace's matrix of 1M nodes by teams of 1, 2, 4 and 8 threads: 75, 55, 67 and
  // 86 us (H200). Rows of coarser levels are three times as long and fewer.
  using RingTeam = WarpTeam<2>;
  using RowTeam = WarpTeam<8>;

  template <class Team, class Body>
  void for_each_row(std::size_t count, const Body& body) {
    for_each(count * Team::size, RowBody<Team, Body>{body});
  }
  template <class Team, class T, class Body, class Combine>
  void reduce_rows_to(std::size_t count, T zero, const Body& body, const Combine& combine,
                      T* result) {
    reduce_later(count * Team::size, zero, RowValue<Team, T, Body>{body, zero}, combine, result);
  }

  static constexpr std::size_t kTeam = kRoundTeam;
  using Suspects = NoSuspects;

  template <class Visits, class Visit, class Settle, class Some>
  void run_rounds(std::size_t count, std::uint8_t* marks, const Visits& visits, const Visit& visit,
                  const Settle& settle, const Some&) {
    constexpr auto kKernel = &rounds_kernel<Visits, Visit, Settle>;
    const auto most = static_cast<std::size_t>(4 * lane().multiprocessor_count());
    const std::size_t items = std::max(count, visits(RoundChanges{count, nullptr}));
    const unsigned int blocks = cooperative_blocks<kKernel>(lane(), block_count(items, most));
    auto counts = allocate<unsigned int>(kRoundCounts);
    auto list = allocate<NodeId>(count);
    clear(counts.data(), kRoundCounts);
    launch_cooperative<kKernel>(stream(), {blocks}, count, visits, visit, settle,
                                RoundMemory{marks, list.data(), counts.data()});
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

  /// Runs a CUB call twice: for the size of its workspace, and with it.
  template <class Call>
  void with_workspace(const Call& call) {
    std::size_t size = 0;
    check_cuda(call(nullptr, size), "querying CUB's workspace");
    auto space = allocate<unsigned char>(std::max<std::size_t>(size, 1));
    check_cuda(call(space.data(), size), "running CUB");
  }

  /// Adds to a slot that several functors share; returns the previous value.
  class Adder {
   public:
    template <class T>
    __device__ T operator()(T& slot, T value) const {
      return atomicAdd(&slot, value);
    }
  };
  [[nodiscard]] Adder adder() const { return {}; }

  /// Accesses that other threads may make at the same time.
  template <class T>
  static __device__ void store(T& slot, T value) {
    static_cast<volatile T&>(slot) = value;
  }
  template <class T>
  static __device__ T load(T& slot) {
    return static_cast<volatile T&>(slot);
  }

 private:
  template <class T>
  static void copy_up(const T* host, std::size_t size, T* to, cudaStream_t in) {
    if (size == 0) return;
    check_cuda(cudaMemcpyAsync(to, host, size * sizeof(T), cudaMemcpyHostToDevice, in),
               "copying to the device");
  }

  const Interrupt& interrupt_;
  ByteCount bytes_;
  std::vector<std::shared_ptr<const void>> held_;  // what uses it has ended then
};

static_assert(Executor<CudaExecutor>);

}  // namespace meshsmooth::detail

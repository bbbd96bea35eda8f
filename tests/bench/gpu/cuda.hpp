#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

namespace meshsmooth::bench {

/// Throws unless a call of CUDA's runtime succeeded; `what` names its purpose.
inline void check_cuda(cudaError_t result, const char* what) {
  if (result == cudaSuccess) return;
  static_cast<void>(cudaGetLastError());  // what is not sticky must not show up again later
  throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(result));
}

class Stream {
 public:
  Stream() {
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
  }
  ~Stream() { static_cast<void>(cudaStreamDestroy(stream_)); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  [[nodiscard]] cudaStream_t get() const { return stream_; }
  void synchronize() const { check_cuda(cudaStreamSynchronize(stream_), "waiting for a stream"); }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { check_cuda(cudaEventCreate(&event_), "making an event"); }
  ~Event() { static_cast<void>(cudaEventDestroy(event_)); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void record(const Stream& stream) {
    check_cuda(cudaEventRecord(event_, stream.get()), "recording an event");
  }
  /// Waits for this event. Both must have been recorded.
  [[nodiscard]] double milliseconds_since(const Event& earlier) const {
    check_cuda(cudaEventSynchronize(event_), "waiting for an event");
    float elapsed = 0;
    check_cuda(cudaEventElapsedTime(&elapsed, earlier.event_, event_), "reading an event's time");
    return elapsed;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Page-locked host memory.
template <class T>
class PinnedArray {
 public:
  PinnedArray() = default;
  explicit PinnedArray(std::size_t size) : size_(size) {
    void* data = nullptr;
    check_cuda(cudaHostAlloc(&data, size * sizeof(T), cudaHostAllocDefault),
               "allocating pinned memory");
    data_ = static_cast<T*>(data);
  }
  PinnedArray(PinnedArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  PinnedArray& operator=(PinnedArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~PinnedArray() {
    if (data_ != nullptr) static_cast<void>(cudaFreeHost(data_));
  }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

enum class Memory {
  pooled,  // stream-ordered, and kept by the pool
  plain,   // cudaMalloc and cudaFree, as in programs without a pool
};

/// Where device memory comes from. Belongs to one stream and one thread; must
/// outlive what it allocated.
class DeviceHeap {
 public:
  DeviceHeap(Memory memory, const Stream& stream) : memory_(memory), stream_(stream.get()) {
    if (memory == Memory::plain) return;
    int device = 0;
    check_cuda(cudaGetDevice(&device), "asking for the device");
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.handleTypes = cudaMemHandleTypeNone;
    properties.location.type = cudaMemLocationTypeDevice;
    properties.location.id = device;
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "making a memory pool");
    std::uint64_t threshold = UINT64_MAX;
    check_cuda(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &threshold),
               "setting a pool's release threshold");
  }
  ~DeviceHeap() {
    static_cast<void>(cudaStreamSynchronize(stream_));
    if (pool_ != nullptr) static_cast<void>(cudaMemPoolDestroy(pool_));
  }
  DeviceHeap(const DeviceHeap&) = delete;
  DeviceHeap& operator=(const DeviceHeap&) = delete;

  [[nodiscard]] void* allocate(std::size_t bytes) {
    void* data = nullptr;
    const std::size_t wanted = bytes == 0 ? 1 : bytes;
    check_cuda(memory_ == Memory::pooled ? cudaMallocFromPoolAsync(&data, wanted, pool_, stream_)
                                         : cudaMalloc(&data, wanted),
               "allocating device memory");
    sizes_[data] = wanted;
    used_bytes_ += wanted;
    if (used_bytes_ > peak_bytes_) peak_bytes_ = used_bytes_;
    return data;
  }
  void release(void* data) noexcept {
    const auto found = sizes_.find(data);
    used_bytes_ -= found->second;
    sizes_.erase(found);
    static_cast<void>(memory_ == Memory::pooled ? cudaFreeAsync(data, stream_) : cudaFree(data));
  }

  [[nodiscard]] Memory memory() const { return memory_; }
  [[nodiscard]] cudaStream_t stream() const { return stream_; }
  /// The most that was allocated at once since the last `restart_peak`.
  [[nodiscard]] std::size_t peak_bytes() const { return peak_bytes_; }
  void restart_peak() { peak_bytes_ = used_bytes_; }

 private:
  Memory memory_;
  cudaStream_t stream_;
  cudaMemPool_t pool_ = nullptr;
  std::unordered_map<void*, std::size_t> sizes_;
  std::size_t used_bytes_ = 0;
  std::size_t peak_bytes_ = 0;
};

/// Uninitialised device memory of a heap.
template <class T>
class DeviceArray {
 public:
  DeviceArray() = default;
  DeviceArray(DeviceHeap& heap, std::size_t size)
      : heap_(&heap), data_(static_cast<T*>(heap.allocate(size * sizeof(T)))), size_(size) {}
  DeviceArray(DeviceArray&& other) noexcept
      : heap_(other.heap_),
        data_(std::exchange(other.data_, nullptr)),
        size_(std::exchange(other.size_, 0)) {}
  DeviceArray& operator=(DeviceArray&& other) noexcept {
    if (this == &other) return *this;
    reset();
    heap_ = other.heap_;
    data_ = std::exchange(other.data_, nullptr);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }
  ~DeviceArray() { reset(); }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return size_ * sizeof(T); }

  /// `source` and `target` hold size() values; done when the stream is.
  void upload(const T* source) {
    check_cuda(cudaMemcpyAsync(data_, source, bytes(), cudaMemcpyHostToDevice, heap_->stream()),
               "copying to the device");
  }
  void download(T* target) const {
    check_cuda(cudaMemcpyAsync(target, data_, bytes(), cudaMemcpyDeviceToHost, heap_->stream()),
               "copying from the device");
  }
  void copy(const DeviceArray& source) {
    check_cuda(
        cudaMemcpyAsync(data_, source.data_, bytes(), cudaMemcpyDeviceToDevice, heap_->stream()),
        "copying on the device");
  }

 private:
  void reset() noexcept {
    if (data_ != nullptr) heap_->release(data_);
    data_ = nullptr;
  }

  DeviceHeap* heap_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace meshsmooth::bench

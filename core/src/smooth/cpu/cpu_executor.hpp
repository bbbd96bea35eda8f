#pragma once

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "mesh/parallel.hpp"
#include "meshsmooth/vec3.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/base/interrupt.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/cpu/cpu_buffer.hpp"
#include "smooth/cpu/held_ball.hpp"
#include "smooth/cpu/suspects.hpp"

namespace meshsmooth::detail {

/// Positions that others write at the same time (Form::asynchronous): each coordinate
/// is whole, a node may be a mixture of old and new.
template <class R>
struct CpuAsynchronousPositions {
  using Real = R;
  Vec3<R>* data;

  [[nodiscard]] Vec3<R> operator[](std::size_t node) const {
    Vec3<R>& p = data[node];
    return {load(p.x), load(p.y), load(p.z)};
  }
  void store(std::size_t node, Vec3<R> position) const {
    Vec3<R>& p = data[node];
    std::atomic_ref<R>(p.x).store(position.x, std::memory_order_relaxed);
    std::atomic_ref<R>(p.y).store(position.y, std::memory_order_relaxed);
    std::atomic_ref<R>(p.z).store(position.z, std::memory_order_relaxed);
  }

 private:
  static R load(R& value) { return std::atomic_ref<R>(value).load(std::memory_order_relaxed); }
};

/// The executor of the CPU backend: host memory, oneTBB inside one arena.
class CpuExecutor {
 public:
  template <class T>
  using Buffer = CpuBuffer<T>;
  template <class Real>
  using AsynchronousPositions = CpuAsynchronousPositions<Real>;
  using Thread = CpuThread;

  CpuExecutor(tbb::task_arena& arena, const Interrupt& interrupt)
      : arena_(arena), interrupt_(interrupt) {}

  /// Host data as this executor sees it: in position.
  template <class T>
  using HostArray = std::span<const T>;
  template <class T>
  [[nodiscard]] HostArray<T> in_executor_memory(std::span<const T> host) const {
    return host;
  }

  template <class T>
  [[nodiscard]] Buffer<T> allocate(std::size_t size) {
    return Buffer<T>(size, bytes_);
  }

  template <class T>
  void upload(const T* host, std::size_t size, T* to) {
    if (size != 0) std::memcpy(to, host, size * sizeof(T));
  }

  template <class T>
  void download(const T* from, std::size_t size, T* host) {
    if (size != 0) std::memcpy(host, from, size * sizeof(T));
  }

  /// Calls `functor(begin, end)` for consecutive ranges that cover [0, count);
  /// stops early when the job is interrupted, which `check` then reports.
  template <class Functor>
  void for_each_range(std::size_t count, const Functor& functor, std::size_t size = kChunk) {
    const std::size_t chunks = (count + size - 1) / size;
    const auto run = [&](std::size_t chunk) {
      if (interrupt_.requested()) return;
      functor(chunk * size, std::min(count, (chunk + 1) * size));
    };
    if (chunks <= 1 || arena_.max_concurrency() == 1) {
      for (std::size_t chunk = 0; chunk < chunks; ++chunk) run(chunk);
    } else {
      run_in(arena_, [&] { parallel_for(chunks, run); });
    }
    check();
  }

  template <class Functor>
  void for_each(std::size_t count, const Functor& functor) {
    for_each_range(
        count, [&](std::size_t begin, std::size_t end) { for_each_block(begin, end, functor); });
  }

  template <class T, class Functor, class Combine>
  [[nodiscard]] T reduce(std::size_t count, T zero, const Functor& functor,
                         const Combine& combine) {
    // Few calls may be long ones: the last colours of a sweep.
    const std::size_t size = std::clamp<std::size_t>(count / 32, 32, kChunk);
    struct Part {  // a word each: those that shared one, as in vector<bool>, would race
      T sum;
    };
    std::vector<Part> partial((count + size - 1) / size, Part{zero});
    for_each_range(
        count,
        [&](std::size_t begin, std::size_t end) {
          T sum = zero;
          for_each_block(begin, end, [&](std::size_t i) { sum = combine(sum, functor(i)); });
          partial[begin / size].sum = sum;
        },
        size);
    T sum = zero;
    for (const Part& part : partial) sum = combine(sum, part.sum);
    return sum;
  }

  template <class T, class Functor, class Combine>
  void reduce_to(std::size_t count, T zero, const Functor& functor, const Combine& combine,
                 T* result) {
    *result = reduce(count, zero, functor, combine);
  }

  using RingTeam = SingleThread;
  using RowTeam = SingleThread;

  template <class Team, class Functor>
  void for_each_row(std::size_t count, const Functor& functor) {
    for_each(count, [&](std::size_t row) { functor(row, Team()); });
  }
  template <class Team, class T, class Functor, class Combine>
  void reduce_rows_to(std::size_t count, T zero, const Functor& functor, const Combine& combine,
                      T* result) {
    reduce_to(
        count, zero, [&](std::size_t row) { return functor(row, Team()); }, combine, result);
  }

  static constexpr std::size_t kTeam = 1;
  using Suspects = CpuSuspects;

  template <class Visits, class Visit, class Settle, class Some>
  void run_rounds(std::size_t count, std::uint8_t* marks, const Visits& visits, const Visit& visit,
                  const Settle& settle, const Some& some) {
    auto list = allocate<NodeId>(count);
    for (RoundChanges changes{count, list.data()}; changes.count > 0;) {
      for_each_range(visits(changes), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; i += kVisitBatch) {
          const std::size_t few = std::min(kVisitBatch, end - i);
          const unsigned int done = some(i, few, changes);
          for (std::size_t n = 0; n < few; ++n) {
            if ((done >> n & 1U) == 0) visit(i + n, changes);
          }
        }
      });
      std::atomic<std::size_t> listed = 0;
      for_each_range(count, [&](std::size_t begin, std::size_t end) {
        std::array<NodeId, kChunk> own;
        const std::size_t marked = take_marked(marks, begin, end, own.data());
        std::size_t moved = 0;
        for (std::size_t n = 0; n < marked; ++n) {
          own[moved] = own[n];
          moved += settle(static_cast<std::size_t>(own[n])) ? 1 : 0;
        }
        if (moved == 0) return;
        NodeId* const place = list.data() + listed.fetch_add(moved, std::memory_order_relaxed);
        std::copy_n(own.data(), moved, place);
      });
      changes.count = listed;
    }
  }

  template <class T>
  T exclusive_scan(T* data, std::size_t count) {
    T sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += std::exchange(data[i], sum);
    return sum;
  }

  template <class Key>
  void sort(Key* keys, std::size_t count) {
    run_in(arena_, [&] { parallel_sort(keys, count); });
    check();
  }

  /// Adds to a slot that functors share and returns the former value. An atomic addition costs
  /// several plain ones, so a single thread does without.
  class Adder {
   public:
    explicit Adder(bool alone) : alone_(alone) {}
    template <class T>
    T operator()(T& slot, T value) const {
      if (alone_) return std::exchange(slot, slot + value);
      return std::atomic_ref<T>(slot).fetch_add(value, std::memory_order_relaxed);
    }

   private:
    bool alone_;
  };
  [[nodiscard]] Adder adder() const { return Adder(arena_.max_concurrency() == 1); }

  /// A store that other threads may make or read at the same time.
  template <class T>
  static void store(T& slot, T value) {
    std::atomic_ref<T>(slot).store(value, std::memory_order_relaxed);
  }
  template <class T>
  static T load(T& slot) {
    return std::atomic_ref<T>(slot).load(std::memory_order_relaxed);
  }

  void synchronize() {}
  /// Work is done when a call returns.
  void hold(const std::shared_ptr<const void>&) {}
  void check() const { interrupt_.check(); }

  /// Adds its lifetime to `seconds`.
  class Timer {
   public:
    Timer(CpuExecutor&, double& seconds) : seconds_(seconds) {}
    ~Timer() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    using Clock = std::chrono::steady_clock;
    double& seconds_;
    Clock::time_point start_ = Clock::now();
  };
  void finish() {}

  /// Ranges of `for_each_range`: how many there are, and which begins at `begin`.
  [[nodiscard]] static std::size_t chunk_count(std::size_t count) {
    return (count + kChunk - 1) / kChunk;
  }
  [[nodiscard]] static std::size_t chunk_of(std::size_t begin) { return begin / kChunk; }

  [[nodiscard]] tbb::task_arena& arena() { return arena_; }
  [[nodiscard]] ByteCount& bytes() { return bytes_; }

 private:
  static constexpr std::size_t kChunk = 2048;

  /// Serially; stops early when the job is interrupted, as a chunk may be all of a mesh of hubs.
  template <class Functor>
  void for_each_block(std::size_t begin, std::size_t end, const Functor& functor) const {
    constexpr std::size_t kBlock = 256;
    while (begin < end && !interrupt_.requested()) {
      const std::size_t stop = std::min(begin + kBlock, end);
      for (; begin < stop; ++begin) functor(begin);
    }
  }

  /// Lists those of [begin, end) whose mark is set, and clears it: without branches that depend on
  /// single marks, as marks of slivers are set at random. Returns how many.
  static std::size_t take_marked(std::uint8_t* marks, std::size_t begin, std::size_t end,
                                 NodeId* list) {
    std::size_t count = 0;
    const auto take = [&](std::size_t i) {
      list[count] = static_cast<NodeId>(i);
      count += std::exchange(marks[i], std::uint8_t{0});
    };
    std::size_t i = begin;
    for (std::uint64_t eight = 0; i + sizeof eight <= end; i += sizeof eight) {
      std::memcpy(&eight, marks + i, sizeof eight);
      if (eight == 0) continue;
      for (std::size_t n = 0; n < sizeof eight; ++n) take(i + n);
    }
    while (i < end) take(i++);
    return count;
  }

  tbb::task_arena& arena_;
  const Interrupt& interrupt_;
  ByteCount bytes_;
};

static_assert(Executor<CpuExecutor>);

}  // namespace meshsmooth::detail

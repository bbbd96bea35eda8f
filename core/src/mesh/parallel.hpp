#pragma once

#include <oneapi/tbb/parallel_sort.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

/// How the core runs functors by oneTBB. Only parallel.cpp uses the templates of its loops: like
/// the library, that file is built without the thread sanitizer, which would report the hand-overs
/// inside as races. The order that oneTBB guarantees is annotated here instead.
namespace meshsmooth::detail {

/// A functor as parallel.cpp sees it.
struct AnyBody {
  void (*call)(const AnyBody& self, std::size_t index);
};

/// Every call happens after the constructor and before the end of the destructor, on any thread.
/// Calls are unordered among each other, so that their races are found.
template <class Functor>
class OrderedBody : public AnyBody {
 public:
  explicit OrderedBody(const Functor& functor) : AnyBody{&call_in_order}, body_(functor) {
    release(this);
  }
  ~OrderedBody() { acquire(&ended_); }
  OrderedBody(const OrderedBody&) = delete;
  OrderedBody& operator=(const OrderedBody&) = delete;

 private:
  static void call_in_order(const AnyBody& any, std::size_t index) {
    acquire(&any);
    const auto& self = static_cast<const OrderedBody&>(any);
    const struct End {
      const char& ended;
      ~End() { release(&ended); }
    } end{self.ended_};
    self.body_(index);
  }

#if defined(__SANITIZE_THREAD__)
  static void acquire(const void* at) { __tsan_acquire(const_cast<void*>(at)); }
  static void release(const void* at) { __tsan_release(const_cast<void*>(at)); }
#else
  static void acquire(const void*) {}
  static void release(const void*) {}
#endif

  const Functor& body_;
  char ended_ = 0;  // its address stands for the ends of the calls
};

void call_in(tbb::task_arena& arena, const AnyBody& functor);
void call_for_each(std::size_t count, const AnyBody& functor);

/// Runs `function()` on a thread of the arena.
template <class Function>
auto run_in(tbb::task_arena& arena, const Function& function) {
  using Result = decltype(function());
  if constexpr (std::is_void_v<Result>) {
    const auto run = [&](std::size_t) { function(); };
    call_in(arena, OrderedBody(run));
  } else {
    std::optional<Result> result;
    run_in(arena, [&] { result.emplace(function()); });
    return *std::move(result);
  }
}

/// Calls `functor(i)` for every i < `count`, on the threads of the current arena.
template <class Functor>
void parallel_for(std::size_t count, const Functor& functor) {
  call_for_each(count, OrderedBody(functor));
}

/// Sorts ascending, on the threads of the current arena.
template <class Key>
void parallel_sort(Key* keys, std::size_t count) {
#if defined(__SANITIZE_THREAD__)
  std::sort(keys, keys + count);  // no functor of ours runs in a sort
#else
  tbb::parallel_sort(keys, keys + count);
#endif
}

inline constexpr std::size_t kRange = 8192;

/// Calls `functor(begin, end)` for consecutive ranges that cover [0, count).
template <class Functor>
void parallel_for_ranges(std::size_t count, const Functor& functor) {
  parallel_for((count + kRange - 1) / kRange,
               [&](std::size_t r) { functor(r * kRange, std::min(count, (r + 1) * kRange)); });
}

/// `combine` over zero and all `functor(i)`, in an order that depends on `count` alone: the same
/// bits for any number of threads.
template <class T, class Functor, class Combine>
[[nodiscard]] T parallel_reduce(std::size_t count, T zero, const Functor& functor,
                                const Combine& combine) {
  static_assert(!std::is_same_v<T, bool>, "functors would share the words of a vector<bool>");
  std::vector<T> partial((count + kRange - 1) / kRange, zero);
  parallel_for_ranges(count, [&](std::size_t begin, std::size_t end) {
    T sum = zero;
    for (std::size_t i = begin; i < end; ++i) sum = combine(sum, functor(i));
    partial[begin / kRange] = sum;
  });
  T sum = zero;
  for (const T& part : partial) sum = combine(sum, part);
  return sum;
}

}  // namespace meshsmooth::detail

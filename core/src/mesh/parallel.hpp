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

/// How the core has oneTBB run bodies. The templates of its loops are used in parallel.cpp alone:
/// like the library, that file is not built with the thread sanitizer, which would take the
/// hand-overs inside for races. What oneTBB promises of the order of bodies is told here instead.
namespace meshsmooth::detail {

/// A body as parallel.cpp sees it.
struct AnyBody {
  void (*call)(const AnyBody& self, std::size_t index);
};

/// Every call comes after the constructor and before the end of the destructor, whatever the
/// threads. Calls are not in any order among each other: their races are found.
template <class Body>
class OrderedBody : public AnyBody {
 public:
  explicit OrderedBody(const Body& body) : AnyBody{&call_in_order}, body_(body) { release(this); }
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

  const Body& body_;
  char ended_ = 0;  // its address stands for the ends of the calls
};

void call_in(tbb::task_arena& arena, const AnyBody& body);
void call_for_each(std::size_t count, const AnyBody& body);

/// `function()` by a thread of the arena.
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

/// `body(i)` for every i < `count`, by the threads of the arena that this one is in.
template <class Body>
void parallel_for(std::size_t count, const Body& body) {
  call_for_each(count, OrderedBody(body));
}

/// Ascending, by the threads of the arena that this one is in.
template <class Key>
void parallel_sort(Key* keys, std::size_t count) {
#if defined(__SANITIZE_THREAD__)
  std::sort(keys, keys + count);  // no body of ours runs in a sort: nothing is lost
#else
  tbb::parallel_sort(keys, keys + count);
#endif
}

inline constexpr std::size_t kRange = 8192;

/// `body(begin, end)` for consecutive ranges that cover [0, count).
template <class Body>
void parallel_for_ranges(std::size_t count, const Body& body) {
  parallel_for((count + kRange - 1) / kRange,
               [&](std::size_t r) { body(r * kRange, std::min(count, (r + 1) * kRange)); });
}

/// `combine` over zero and all `body(begin, end)`, in their order: the same bits for any number
/// of threads.
template <class T, class Body, class Combine>
[[nodiscard]] T parallel_reduce(std::size_t count, T zero, const Body& body,
                                const Combine& combine) {
  static_assert(!std::is_same_v<T, bool>, "bodies would share the words of a vector<bool>");
  std::vector<T> partial((count + kRange - 1) / kRange, zero);
  parallel_for_ranges(count, [&](std::size_t begin, std::size_t end) {
    partial[begin / kRange] = body(begin, end);
  });
  T sum = zero;
  for (const T& part : partial) sum = combine(sum, part);
  return sum;
}

}  // namespace meshsmooth::detail

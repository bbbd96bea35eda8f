#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/mesh.hpp"
#include "smooth/base/byte_count.hpp"

namespace meshsmooth::detail {

/// Sums up in `Executor::reduce`.
struct Plus {
  template <class T>
  MESHSMOOTH_HD T operator()(const T& a, const T& b) const {
    return a + b;
  }
};

/// Functors of the kind that steps pass to an executor; the concept checks with them.
struct ExampleFunctor {
  MESHSMOOTH_HD std::int64_t operator()(std::size_t) const { return 0; }
  MESHSMOOTH_HD std::int64_t operator()(std::int64_t a, std::int64_t b) const { return a + b; }
  MESHSMOOTH_HD void operator()(std::size_t, std::size_t) const {}
};
template <class Team>
struct ExampleRowFunctor {
  MESHSMOOTH_HD std::int64_t operator()(std::size_t, const Team&) const { return 0; }
};

/// How many visits `Executor::run_rounds` makes at once.
inline constexpr std::size_t kVisitBatch = 8;

/// What the last round of `Executor::run_rounds` changed; before the first round all nodes, which
/// are not listed.
struct RoundChanges {
  std::size_t count;
  const NodeId* nodes;  // in any order
};
struct ExampleRounds {
  MESHSMOOTH_HD std::size_t operator()(const RoundChanges&) const { return 0; }
  MESHSMOOTH_HD void operator()(std::size_t, const RoundChanges&) const {}
  unsigned int operator()(std::size_t, std::size_t, const RoundChanges&) const { return 0; }
};

/// `Executor::Suspects` where rounds visit all elements.
struct NoSuspects {
  static constexpr bool kPossible = false;
};

/// What a step that both backends share needs of a backend: one memory space and a few
/// operations on it. Functors are called with every index below `count` in any order, by any
/// number of threads, and access only memory of this executor.
///
///   Buffer<T>             owns executor memory; moves, never copies
///   HostArray<T>          host data as this executor sees it
///   allocate<T>(n)        uninitialized Buffer<T>; throws OutOfMemory
///   in_executor_memory(span)  HostArray<T> of host data
///   upload(host, n, to)   host to executor memory
///   download(from, n, to) executor to host memory
///   for_each(n, f)        f(i)
///   reduce(n, zero, f, op)  op over f(i); the grouping depends on n alone, so that
///                         sums have the same bits for any number of threads
///   reduce_to(n, zero, f, op, to)  the same, into executor memory
///   RingTeam, RowTeam     threads that share a ring, or a longer row: `SingleThread`, or alike
///   for_each_row<Team>(n, f)  f(i, team), called by each thread of a team with its own
///   reduce_rows_to<Team>(n, zero, f, op, to)  the same; of a team one thread's value counts
///   run_rounds(n, marks, visits, visit, settle, some)  rounds: visit(i, c) for all i below
///                         visits(c), then settle(i) for all i below n whose mark a visit has set
///                         to 1, which is cleared; c lists those that return true, and the rounds
///                         end where there are none. kTeam: how many threads are to share a
///                         node's visit. Host code may visit by some(i, count, c), for up to
///                         kVisitBatch at once: bit k of the result means that visit(i + k, c) is
///                         done
///   Suspects              kPossible: whether tetrahedra that moves along straight ways might
///                         break can be told from all others, which rounds need not visit; then
///                         find(e, elements, n, before, after) lists them, of those positive before
///   exclusive_scan(data, n)  in place over n entries; returns the sum
///   adder()               fetch_add for functors that share a slot
///   store, load           of slots that other functors access at the same time
///   AsynchronousPositions<Real>  positions that functors read and write at the same time
///   Thread                the team of one thread by which a functor moves a node
///   Timer(executor, seconds)  adds the time of the work inside its lifetime, at the
///                         latest when `finish()` returns
///   synchronize()         waits for all queued work
///   hold(pointer)         keeps what it points to until all work of the job has ended
///   finish()              waits for all work and completes the timers; ends a job
///   bytes()               counts what is allocated, by the stages of the job
///   check()               throws Cancelled or DeadlineExceeded when the job must end
template <class E>
concept Executor = requires(E& e, double* data, const double* host, std::span<const double> span,
                            std::int64_t* sums, std::uint32_t& slot, std::size_t n,
                            ExampleFunctor f, ExampleRounds rounds, std::uint8_t* marks,
                            const typename E::template AsynchronousPositions<double>& x) {
  { e.template allocate<double>(n) } -> std::same_as<typename E::template Buffer<double>>;
  { e.template allocate<double>(n).data() } -> std::same_as<double*>;
  { e.in_executor_memory(span) } -> std::same_as<typename E::template HostArray<double>>;
  { e.upload(host, n, data) } -> std::same_as<void>;
  { e.download(host, n, data) } -> std::same_as<void>;
  { e.for_each(n, f) } -> std::same_as<void>;
  { e.reduce(n, std::int64_t{0}, f, f) } -> std::same_as<std::int64_t>;
  { e.reduce_to(n, std::int64_t{0}, f, f, sums) } -> std::same_as<void>;
  {
    e.template for_each_row<typename E::RowTeam>(n, ExampleRowFunctor<typename E::RowTeam>())
    } -> std::same_as<void>;
  {
    e.template reduce_rows_to<typename E::RingTeam>(
        n, std::int64_t{0}, ExampleRowFunctor<typename E::RingTeam>(), f, sums)
    } -> std::same_as<void>;
  { e.run_rounds(n, marks, rounds, rounds, f, rounds) } -> std::same_as<void>;
  { E::kTeam } -> std::convertible_to<std::size_t>;
  { E::Suspects::kPossible } -> std::convertible_to<bool>;
  { e.exclusive_scan(sums, n) } -> std::same_as<std::int64_t>;
  { e.adder()(slot, std::uint32_t{1}) } -> std::same_as<std::uint32_t>;
  { E::store(slot, std::uint32_t{1}) } -> std::same_as<void>;
  { E::load(slot) } -> std::same_as<std::uint32_t>;
  { x.store(n, x[n]) } -> std::same_as<void>;
  { e.synchronize() } -> std::same_as<void>;
  { e.hold(std::shared_ptr<const void>()) } -> std::same_as<void>;
  { e.bytes() } -> std::same_as<ByteCount&>;
  { e.check() } -> std::same_as<void>;
  { e.finish() } -> std::same_as<void>;
}
&&std::default_initializable<typename E::Thread>&&
    std::constructible_from<typename E::Timer, E&, double&>;

}  // namespace meshsmooth::detail

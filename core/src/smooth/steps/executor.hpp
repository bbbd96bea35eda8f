#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace meshsmooth::detail {

/// What a step needs of a backend: one memory space and a few verbs on it.
/// Bodies are called with every index below `count` in any order, by any number
/// of threads, and see only memory of this executor.
///
///   allocate<T>(n)        uninitialised Buffer<T>, freed with its owner; throws OutOfMemory
///   in_executor_memory(span)  HostArray<T>: host data as this executor sees it
///   upload(host, n, to)   host to executor memory
///   download(from, n, to) executor to host memory
///   for_each(n, f)        f(i)
///   reduce(n, zero, f, op)  op over f(i); the grouping is fixed by n alone, so that
///                         sums have the same bits for any number of threads
///   exclusive_scan(data, n)  in place over n entries; returns the sum
///   sort(keys, n)         ascending; equal keys are indistinguishable
///   unique(keys, n)       drops repeated neighbours; returns what is left
///   lower_bound(keys, n, v)  index of the first of ascending keys not below v
///   adder()               fetch_add for bodies that share a slot
///   store, load           of slots that other bodies use at the same time
///   AsynchronousPositions<Real>    positions that bodies read and write at the same time
///   kKeptCorners          corners of a ball that a body may keep beside itself
///   Timer(executor, seconds)  adds the time of the work inside its lifetime, at the
///                         latest when `finish()` returns
///   finish()              waits for all work; ends a job
///   check()               throws Cancelled or DeadlineExceeded when the job must end
template <class E>
concept Executor = requires(E& e, std::uint64_t* keys, std::int64_t* sums, std::uint32_t* slots) {
  { e.template allocate<double>(std::size_t{1}).data() } -> std::same_as<double*>;
  { e.exclusive_scan(sums, std::size_t{1}) } -> std::same_as<std::int64_t>;
  {e.sort(keys, std::size_t{1})};
  { e.unique(keys, std::size_t{1}) } -> std::same_as<std::size_t>;
  { e.lower_bound(keys, std::size_t{1}, keys[0]) } -> std::same_as<std::size_t>;
  { e.adder()(slots[0], std::uint32_t{1}) } -> std::same_as<std::uint32_t>;
  {e.synchronize()};
  {e.check()};
  {e.finish()};
};

}  // namespace meshsmooth::detail

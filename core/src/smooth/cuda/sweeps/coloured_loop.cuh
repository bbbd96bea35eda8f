#pragma once

#include <cooperative_groups.h>

#include "smooth/cuda/sweeps/ball_records.cuh"

namespace meshsmooth::detail {

/// The Gauss-Seidel loop of a team of kTeam threads in a cooperative kernel: colour after colour,
/// with a grid barrier in between. Software-pipelined: what the next visit needs and no sweep
/// changes is fetched during this one, across the barrier too (at 100k smart Laplacian 6.2 to 5.24
/// ms for 20 sweeps, optimizer 200 to 179 us a sweep, each together with another change; H200).
///
/// Ahead  what is known of a visit before its positions: a member `ball`, and `fetch()`, which
///        loads the rest from it
template <int kTeam, unsigned int kThreads, class Ahead>
class ColouredLoop {
 public:
  __device__ ColouredLoop(const ColouredNodes& nodes, const Ahead& ahead)
      : nodes_(nodes),
        own_((blockIdx.x * kThreads + threadIdx.x) / kTeam),
        last_record_(nodes.first[nodes.colour_count] - 1),
        n_(own_),
        end_(nodes.first[1]),
        ahead_(ahead) {
    ahead_.ball = record_at(n_);
    ahead_.fetch();
  }

  /// One sweep over all colours, without the barrier at its end. `visit(now)` visits a node,
  /// `finish(found)` takes what that returned. Two functors, so that `visit` is inlined here and
  /// not into another functor first: which multiply-adds nvcc fuses depends on it, hence the bits
  /// of the optimizer on surfaces in float64.
  template <class Grid, class Visit, class Finish>
  __device__ void sweep(const Grid& grid, const Visit& visit, const Finish& finish) {
    const std::uint32_t teams = gridDim.x * kThreads / kTeam;
    for (int c = 0; c < nodes_.colour_count; ++c) {
      const int next_colour = c + 1 < nodes_.colour_count ? c + 1 : 0;
      const std::uint32_t next_begin = nodes_.first[next_colour];
      const std::uint32_t next_end = nodes_.first[next_colour + 1];
      if (n_ >= end_) {
        ahead_.ball = record_at(next_begin + own_);
        ahead_.fetch();
      }
      while (n_ < end_) {
        const Ahead now = ahead_;
        n_ += teams;
        ahead_.ball = record_at(n_ < end_ ? n_ : next_begin + own_);
        finish(visit(now));
        ahead_.fetch();
      }
      n_ = next_begin + own_;
      end_ = next_end;
      if (c + 1 < nodes_.colour_count) grid.sync();
    }
  }

 private:
  [[nodiscard]] __device__ BallRecord record_at(std::uint32_t n) const {
    return nodes_.records[n < last_record_ ? n : last_record_];
  }

  ColouredNodes nodes_;
  std::uint32_t own_, last_record_, n_, end_;
  Ahead ahead_;
};

}  // namespace meshsmooth::detail

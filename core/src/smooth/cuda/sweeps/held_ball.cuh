#pragma once

#include "smooth/cuda/primitives/vector_access.cuh"
#include "smooth/cuda/sweeps/ball_records.cuh"
#include "smooth/guard/acceptance.hpp"

namespace meshsmooth::detail {

/// A tetrahedron of a ball in the registers of one thread. A second text of `quality_with`: with
/// the corners held, the trials of a move read no memory (smart Laplacian 9.6 to 6.4 ms for 20
/// sweeps at 100k, H200). parity_test compares the bits with the CPU's.
template <class Real>
struct HeldTetrahedron {
  Vec3<Real> a, b, c;  // the corners that stay: own, a, b, c are oriented as the element
  int own;             // the corner that moves

  template <class P>
  __device__ void load(const Elements& elements, const P& x, ElementId e, NodeId node) {
    NodeId ids[4];
    load_group(elements.runs[0].nodes + std::size_t{e} * 4, ids);
    own = ids[1] == node ? 1 : ids[2] == node ? 2 : ids[3] == node ? 3 : 0;
    const NodeId first = own == 0 ? ids[1] : ids[0];
    const NodeId second = own == 0 ? ids[2] : own == 1 ? ids[3] : own == 2 ? ids[1] : ids[2];
    const NodeId third = own == 1 ? ids[2] : own == 3 ? ids[1] : ids[3];
    a = x[static_cast<std::size_t>(first)];
    b = x[static_cast<std::size_t>(second)];
    c = x[static_cast<std::size_t>(third)];
  }
  /// `tetrahedron_quality` of the corners in the element's order, for the same rounding.
  [[nodiscard]] __device__ double quality(Vec3<Real> position) const {
    const Vec3<Real> p0 = own == 0 ? position : a;
    const Vec3<Real> p1 = own == 0 ? a : own == 1 ? position : own == 2 ? b : c;
    const Vec3<Real> p2 = own == 0 ? b : own == 1 ? c : own == 2 ? position : b;
    const Vec3<Real> p3 = own == 0 || own == 2 ? c : own == 1 ? b : position;
    return tetrahedron_quality(vec3_cast<double>(p0), vec3_cast<double>(p1), vec3_cast<double>(p2),
                               vec3_cast<double>(p3));
  }
};

/// A test in single precision whether the quality of a tetrahedron is certainly below a threshold:
/// most moves are rejected, at a third of the cost of evaluating them in double.
///
/// quality = 432 det^2 / L^3, L the sum of the squared edges, so it is below w if
/// det < sqrt(w / 432) L^1.5. Edges are differences of floats, with a relative error of 2^-24; the
/// error of det as computed is less than 14 2^-24 |u||v||w| of three edges that meet, and their
/// product is at most (L / 3)^1.5: 1.6e-7 L^1.5.
class QualityThreshold {
 public:
  __device__ explicit QualityThreshold(double worst)
      : root_((sqrtf(static_cast<float>(worst) / 432.0F) - 1e-6F) * (1 - 1e-5F)) {}

  /// Only thresholds above 0 can be tested.
  [[nodiscard]] __device__ bool usable() const { return root_ > 0; }

  /// The facet opposite to the node that moves.
  struct Facet {
    Vec3<float> normal;
    float length;

    __device__ explicit Facet(const HeldTetrahedron<float>& t)
        : normal(cross(t.b - t.a, t.c - t.a)),
          length(add_square(t.b - t.a, add_square(t.c - t.a, add_square(t.c - t.b, 0)))) {}
  };
  [[nodiscard]] __device__ bool is_above(const HeldTetrahedron<float>& t, const Facet& facet,
                                         Vec3<float> position) const {
    const Vec3<float> u = t.a - position;
    const float det = fmaf(facet.normal.x, u.x, fmaf(facet.normal.y, u.y, facet.normal.z * u.z));
    const float length =
        add_square(u, add_square(t.b - position, add_square(t.c - position, facet.length)));
    const float size = length * __fsqrt_rn(length);
    return det < root_ * size && size > 1e-25F && size < 1e37F;  // no underflow, no overflow
  }

 private:
  static __device__ float add_square(Vec3<float> v, float sum) {
    return fmaf(v.x, v.x, fmaf(v.y, v.y, fmaf(v.z, v.z, sum)));
  }

  float root_;
};

/// The ball of a node, held by a team, each thread some tetrahedra: memory is read once for all
/// trials of a move.
template <class Team, class Real>
class HeldBall {
 public:
  /// Whether a ball can be held.
  static __device__ bool fits(const Surroundings& around, const BallRecord& ball) {
    const ElementShape& shape = *around.elements.runs[0].shape;
    return ball.size <= kEach * Team::size && around.elements.run_count == 1 &&
           shape.dimension == 3 && shape.node_count == 4;
  }

  /// `first`: the thread's first element of the ball, if it has one.
  template <class P>
  __device__ HeldBall(const Team& team, const Surroundings& around, const P& x,
                      const BallRecord& ball, ElementId first)
      : team_(team), size_(ball.size) {
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int at = team.rank + n * Team::size;
      if (at >= size_) continue;
      const ElementId e = n == 0 ? first : around.balls.entries[ball.begin + at];
      elements_[n].load(around.elements, x, e, ball.node);
    }
  }

  /// `accept_move` from `before`, on held tetrahedra.
  __device__ Vec3<Real> accept_move(Vec3<Real> before, Vec3<Real> candidate, Acceptance acceptance,
                                    bool& held) const {
    if (candidate == before) return before;
    double quality_before[kEach];
    double worst = 2.0;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      quality_before[n] = 0;
      if (!has(n)) continue;
      quality_before[n] = elements_[n].quality(before);
      if (quality_before[n] < worst) worst = quality_before[n];
    }
    if (acceptance.smart) worst = team_.lowest(worst);
    const unsigned int hopeless =
        acceptance.smart ? find_hopeless(before, candidate, QualityThreshold(worst)) : 0;
    Real share = 1;
    for (int trial = 0; trial < kMoveTrials; ++trial, share /= 2) {
      bool accepted = (hopeless >> trial & 1U) == 0;
      if (accepted) {
        const Vec3<Real> position = position_of(before, candidate, trial, share);
#pragma unroll
        for (int n = 0; n < kEach; ++n) {
          if (!has(n)) continue;
          const double quality = elements_[n].quality(position);
          accepted &= !(acceptance.smart && quality < worst) &&
                      !(acceptance.guard && !(quality > 0) && quality_before[n] > 0);
        }
        if (team_.all(accepted)) return position;
      }
      held = true;
    }
    return before;
  }

 private:
  static constexpr int kEach = 64 / Team::size;

  [[nodiscard]] __device__ bool has(int n) const { return team_.rank + n * Team::size < size_; }
  static __device__ Vec3<Real> position_of(Vec3<Real> before, Vec3<Real> candidate, int trial,
                                           Real share) {
    return trial == 0 ? candidate : before + share * (candidate - before);
  }

  /// The trials that would certainly lower the worst quality, as a bit mask.
  __device__ unsigned int find_hopeless(Vec3<Real> before, Vec3<Real> candidate,
                                        const QualityThreshold& threshold) const {
    unsigned int hopeless = 0;
    if constexpr (std::is_same_v<Real, float>) {
      if (!threshold.usable()) return 0;
      bool below[kMoveTrials] = {};
#pragma unroll
      for (int n = 0; n < kEach; ++n) {
        if (!has(n)) continue;
        const QualityThreshold::Facet facet(elements_[n]);
        float share = 1;
#pragma unroll
        for (int trial = 0; trial < kMoveTrials; ++trial, share /= 2) {
          below[trial] |=
              threshold.is_above(elements_[n], facet, position_of(before, candidate, trial, share));
        }
      }
#pragma unroll
      for (int trial = 0; trial < kMoveTrials; ++trial) {
        hopeless |= (team_.all(!below[trial]) ? 0U : 1U) << trial;
      }
    }
    return hopeless;
  }

  const Team& team_;
  int size_;
  HeldTetrahedron<Real> elements_[kEach];
};

}  // namespace meshsmooth::detail

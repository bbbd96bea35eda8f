#pragma once

#include "smooth/cuda/sweeps/ball_records.cuh"
#include "smooth/cuda/sweeps/padded_positions.cuh"
#include "smooth/optimize/optimize_rule.hpp"

namespace meshsmooth::detail {

/// The other nodes of a tetrahedron of a ball.
struct Others {
  NodeId ids[3];
};

/// What tetrahedra aim at, where it is not their ideal shape.
template <class R>
struct TetrahedronTargets {
  PaddedPositions<R> reference;
  const ElementShape* shape;
  bool some_flat;    // of the reference
  double certainty;  // see `Targets`
};

/// `BallTerms` of a ball of tetrahedra, for one thread of a team. The terms of its first `kHeld`
/// tetrahedra are held in the block's shared memory, the others are gathered in every pass
/// (optimizer at 100k 200 to 179 us a sweep, together with the prefetch, H200). A second text of
/// `BallTerms` for that reason; parity_test compares the outcomes with the CPU's, up to rounding.
/// With `kReference` they aim at those of a reference mesh.
template <int kHeld, int kThreads, bool kReference, class Team, class R>
class TeamTerms {
 public:
  using Real = R;
  static constexpr bool kTetrahedra = true;
  static constexpr int kValues = kReference ? 9 : 8;
  /// No bank conflicts. The gradient of the size is held negated, which costs nothing.
  struct Memory {
    double held[kHeld][kValues][kThreads];
  };

  /// The `n`-th tetrahedron of a thread; past the end a harmless one.
  static __device__ Others others(const Team& team, const NodeId* opposite, const BallRecord& ball,
                                  int n) {
    const int at = team.rank + n * Team::size;
    if (at >= ball.size) return {ball.node, ball.node, ball.node};
    const NodeId* const from = opposite + 3 * (ball.begin + at);
    return {from[0], from[1], from[2]};
  }

  /// `first`: of the first tetrahedron.
  __device__ TeamTerms(const Team& team, const NodeId* opposite, const PaddedPositions<R>& x,
                       const TetrahedronTargets<R>& targets, const BallRecord& ball,
                       const Others& first, Memory& memory)
      : team_(team),
        opposite_(opposite),
        x_(x),
        targets_(targets),
        ball_(ball),
        memory_(memory),
        count_((ball.size - team.rank + Team::size - 1) / Team::size) {
    position_ = x[static_cast<std::size_t>(ball.node)];
    if constexpr (kReference) target_ = targets.reference[static_cast<std::size_t>(ball.node)];
    hold(first);
  }

  __device__ void move_to(Vec3<R> position) {
    position_ = position;
    hold(others(team_, opposite_, ball_, 0));
  }
  [[nodiscard]] __device__ Vec3<R> position() const { return position_; }
  [[nodiscard]] __device__ const PaddedPositions<R>& positions() const { return x_; }
  [[nodiscard]] __device__ double certainty() const { return kReference ? targets_.certainty : 1; }

  template <class Body>
  __device__ void for_each(const Body& body) const {
#pragma unroll 1
    for (int n = 0; n < count_; ++n) {
      body(n < kHeld ? recall(n) : term(fetch(others(team_, opposite_, ball_, n))));
    }
  }

 private:
  struct Corners {
    Vec3<R> at[3];
    Vec3<R> target[kReference ? 3 : 1];
  };

  [[nodiscard]] __device__ Corners fetch(const Others& others) const {
    Corners corners;
#pragma unroll
    for (int n = 0; n < 3; ++n) {
      const auto node = static_cast<std::size_t>(others.ids[n]);
      corners.at[n] = x_[node];
      if constexpr (kReference) corners.target[n] = targets_.reference[node];
    }
    return corners;
  }
  [[nodiscard]] __device__ CornerTerm term(const Corners& corners) const {
    const Vec3d own = vec3_cast<double>(position_);
    const Vec3d a = vec3_cast<double>(corners.at[0]) - own;
    const Vec3d b = vec3_cast<double>(corners.at[1]) - own;
    const Vec3d c = vec3_cast<double>(corners.at[2]) - own;
    if constexpr (kReference) {
      const Vec3d home = vec3_cast<double>(target_);
      const Vec3d target[] = {vec3_cast<double>(corners.target[0]) - home,
                              vec3_cast<double>(corners.target[1]) - home,
                              vec3_cast<double>(corners.target[2]) - home};
      return tetrahedron_term(a, b, c, target, *targets_.shape, targets_.some_flat);
    } else {
      return tetrahedron_term(a, b, c);
    }
  }

  /// Software-pipelined: the loads for the next tetrahedra are in flight meanwhile.
  __device__ void hold(const Others& first) {
    Corners ahead = fetch(first);
    Others next = others(team_, opposite_, ball_, 1);
#pragma unroll 1
    for (int n = 0; n < count_ && n < kHeld; ++n) {
      const Corners corners = ahead;
      ahead = fetch(next);
      next = others(team_, opposite_, ball_, n + 2);
      const CornerTerm t = term(corners);
      double(&held)[kValues][kThreads] = memory_.held[n];
      held[0][threadIdx.x] = t.volume;
      held[1][threadIdx.x] = t.size;
      held[2][threadIdx.x] = t.volume_gradient.x;
      held[3][threadIdx.x] = t.volume_gradient.y;
      held[4][threadIdx.x] = t.volume_gradient.z;
      held[5][threadIdx.x] = -t.size_gradient.x;
      held[6][threadIdx.x] = -t.size_gradient.y;
      held[7][threadIdx.x] = -t.size_gradient.z;
      if constexpr (kReference) held[8][threadIdx.x] = t.curvature;
    }
  }
  [[nodiscard]] __device__ CornerTerm recall(int n) const {
    const double(&held)[kValues][kThreads] = memory_.held[n];
    const unsigned int t = threadIdx.x;
    double curvature = kTetrahedronCurvature;
    if constexpr (kReference) curvature = held[8][t];
    return {kTetrahedronWeight,
            held[0][t],
            held[1][t],
            curvature,
            {held[2][t], held[3][t], held[4][t]},
            {-held[5][t], -held[6][t], -held[7][t]}};
  }

  const Team& team_;
  const NodeId* opposite_;
  const PaddedPositions<R>& x_;
  const TetrahedronTargets<R>& targets_;
  const BallRecord& ball_;
  Memory& memory_;
  int count_;
  Vec3<R> position_;
  Vec3<R> target_;  // of the node
};

}  // namespace meshsmooth::detail

#pragma once

#include <tuple>
#include <type_traits>

#include "meshsmooth/methods.hpp"
#include "smooth/base/element_quality.hpp"
#include "smooth/base/surroundings.hpp"

namespace meshsmooth::detail {

// The rules: the weighted mean of a node's surroundings, or the node's own position if there is
// nothing to average. Sums run in the rows' order, which is the caller's.

/// The mean from a sum of positions: divided, not multiplied by the inverse. Faster versions of
/// `mean_of` that gather positions in their own way (teams, SELL rings, patches) end in it too.
template <class Real>
MESHSMOOTH_HD Vec3<Real> mean_of_sum(Vec3<Real> sum, Real count) {
  return {sum.x / count, sum.y / count, sum.z / count};
}

/// The mean of the positions of some nodes; that of `node` if there are none.
template <class P>
MESHSMOOTH_HD Vec3<typename P::Real> mean_of(const P& x, const NodeId* begin, const NodeId* end,
                                             std::size_t node) {
  using Real = typename P::Real;
  if (begin == end) return x[node];
  Vec3<Real> sum{0, 0, 0};
  MESHSMOOTH_UNROLL(8)
  for (const NodeId* n = begin; n != end; ++n) sum += x[static_cast<std::size_t>(*n)];
  return mean_of_sum(sum, static_cast<Real>(end - begin));
}

/// x' = sum_j x_j / |ring|. Source: Xiao et al. 2019, eq. 1.
struct UniformMean {
  static constexpr bool reads_balls = false;

  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    return mean_of(x, around.rings.begin(node), around.rings.end(node), node);
  }
};

/// x' = sum_j w_j x_j / sum_j w_j with w = length^Power; edges of length zero
/// carry no weight.
template <int Power>
struct EdgeLengthMean {
  static_assert(Power == 1 || Power == -1);
  static constexpr bool reads_balls = false;

  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    using Real = typename P::Real;
    const Vec3<Real> own = x[node];
    Vec3<Real> sum{0, 0, 0};
    Real weights = 0;
    for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
      const Vec3<Real> edge = x[static_cast<std::size_t>(*n)] - own;
      const Real length = norm(edge);
      if (!(length > 0)) continue;
      const Real weight = Power == 1 ? length : 1 / length;
      sum += weight * edge;
      weights += weight;
    }
    return weights > 0 ? own + (1 / weights) * sum : own;
  }
};

/// x' = sum_e V_e c_e / sum_e V_e over the ball's elements, c_e the mean of an
/// element's nodes.
struct BallVolumeMean {
  static constexpr bool reads_balls = true;

  template <class P>
  MESHSMOOTH_HD Vec3<typename P::Real> operator()(const Surroundings& around, const P& x,
                                                  std::size_t node) const {
    using Real = typename P::Real;
    const Vec3d own = vec3_cast<double>(x[node]);
    Vec3d sum{0, 0, 0};
    double weights = 0;
    for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
      const ElementView element = around.elements[*e];
      const ElementMass mass = element_mass(*element.shape, [&](int n) {
        return vec3_cast<double>(x[static_cast<std::size_t>(element.nodes[n])]) - own;
      });
      sum += mass.volume * mass.centre;
      weights += mass.volume;
    }
    return weights > 0 ? vec3_cast<Real>(own + (1 / weights) * sum) : x[node];
  }
};

/// The means of `with_mean_of`: a backend has sweeps for each.
using Means = std::tuple<UniformMean, EdgeLengthMean<1>, EdgeLengthMean<-1>, BallVolumeMean>;

/// Calls `functor(mean)` with the mean of a weighting. `plan_job` knows which one reads balls.
template <class Functor>
void with_mean(Weighting weighting, const Functor& functor) {
  switch (weighting) {
    case Weighting::uniform:
      return functor(UniformMean{});
    case Weighting::inverse_edge_length:
      return functor(EdgeLengthMean<-1>{});
    case Weighting::edge_length:
      return functor(EdgeLengthMean<1>{});
    case Weighting::ball_volume:
      return functor(BallVolumeMean{});
  }
}

/// Calls `functor(mean)` with the mean of a method whose sweeps step towards it by the method's
/// `relaxation`: one overload for each kind of such methods.
template <class M, class Functor>
requires requires(const M& method) { Weighting{method.weighting}; }
void with_mean_of(const M& method, const Functor& functor) { with_mean(method.weighting, functor); }

/// What takes any mean.
struct AnyMean {
  template <class Mean>
  void operator()(const Mean&) const {}
};

/// A method with a `with_mean_of`.
template <class M>
concept AveragingMethod = requires(const M& method) {
  with_mean_of(method, AnyMean{});
};

/// One relaxed step towards a goal. A node at its goal stays, and factor 1 reaches the goal
/// exactly.
template <class Real>
MESHSMOOTH_HD Vec3<Real> step_to(Vec3<Real> goal, Vec3<Real> own, Real factor) {
  return factor == 1 ? goal : own + factor * (goal - own);
}

/// `step_to` the mean.
template <class Mean, class P>
MESHSMOOTH_HD Vec3<typename P::Real> step_towards(const Mean& mean, const Surroundings& around,
                                                  const P& x, std::size_t node,
                                                  typename P::Real factor) {
  return step_to(mean(around, x, node), x[node], factor);
}

}  // namespace meshsmooth::detail

#pragma once

#include "smooth/base/surroundings.hpp"

namespace meshsmooth::detail {

/// One corner tetrahedron (triangle) at a node, as a function of how far the node is
/// moved. With T the shape matrix of the corner, its determinant D is linear and its
/// squared norm S a parabola in the displacement d:
///
///   D(d) = volume + volume_gradient . d
///   S(d) = size + size_gradient . d + curvature / 2 |d|^2
///
/// The mean ratio of the corner is dimension * D^(2 / dimension) / S.
struct CornerTerm {
  double weight;  // the corners of an element weigh 1 together
  double volume;
  double size;
  double curvature;
  Vec3d volume_gradient;
  Vec3d size_gradient;

  [[nodiscard]] MESHSMOOTH_HD double volume_at(Vec3d d) const {
    return volume + dot(volume_gradient, d);
  }
  [[nodiscard]] MESHSMOOTH_HD double size_at(Vec3d d) const {
    return size + dot(size_gradient, d) + 0.5 * curvature * dot(d, d);
  }
};

/// The role of local node `own` in corner `corner`: -1 its origin, 0 … 2 the end of
/// that edge, 3 none.
MESHSMOOTH_HD inline int role_in_corner(const CornerShape& corner, int own, int dimension) {
  if (corner.node == own) return -1;
  for (int m = 0; m < dimension; ++m) {
    if (corner.neighbours[m] == own) return m;
  }
  return 3;
}

/// The term of a corner against a target. `edges` begin at `origin`, which is relative to the node
/// that moves; `role` as from `role_in_corner`.
template <int kDimension>
MESHSMOOTH_HD CornerTerm term_of_edges(const Vec3d (&edges)[kDimension], Vec3d origin, int role,
                                       const IdealCorner& target, Vec3d reference, double weight) {
  const auto& w = target.inverse;
  CornerTerm term{};
  term.weight = weight;
  for (int column = 0; column < kDimension; ++column) {
    Vec3d t{0, 0, 0};
    double share = 0;  // of the displacement in t
    for (int m = 0; m < kDimension; ++m) {
      t += w[m][column] * edges[m];
      if (role < 0) share -= w[m][column];
      if (role == m) share += w[m][column];
    }
    term.size += dot(t, t);
    term.size_gradient += (2 * share) * t;
    term.curvature += 2 * share * share;
  }

  // D is the node's height over the opposite facet (edge), times that.
  const double inverse = 1 / target.determinant;
  const Vec3d foot = role < 0 ? edges[0] : origin;
  if constexpr (kDimension == 3) {
    term.volume_gradient = role < 0 ? cross(edges[2] - edges[0], edges[1] - edges[0])
                                    : cross(edges[(role + 1) % 3], edges[(role + 2) % 3]);
  } else {
    term.volume_gradient = role < 0    ? cross(reference, edges[1] - edges[0])
                           : role == 0 ? cross(edges[1], reference)
                                       : cross(reference, edges[0]);
  }
  term.volume_gradient = inverse * term.volume_gradient;
  term.volume = -dot(foot, term.volume_gradient);
  return term;
}

/// The term of corner `k` as local node `own` moves. `get(n)` gives the position of
/// local node n relative to it.
template <int kDimension, class Get>
MESHSMOOTH_HD CornerTerm corner_term(const ElementShape& shape, int k, int role, const Get& get,
                                     const IdealCorner& target, Vec3d reference) {
  const CornerShape& corner = shape.corners[k];
  const Vec3d origin = get(corner.node);
  Vec3d edges[kDimension];
  for (int m = 0; m < kDimension; ++m) edges[m] = get(corner.neighbours[m]) - origin;
  return term_of_edges<kDimension>(edges, origin, role, target, reference,
                                   is_simplex(shape) ? 1.0 : 1.0 / shape.corner_count);
}

inline constexpr double kTetrahedronWeight = 1;
inline constexpr double kTetrahedronCurvature = 3;

/// `corner_term` of a tetrahedron at the node that moves; the others relative to it, in
/// the order of the corner's edges. D = sqrt(2) det, S = half the sum of the squared
/// edges: with s = a + b + c, 2 (|a|^2 + |b|^2 + |c|^2) - |s|^2 / 2.
MESHSMOOTH_HD inline CornerTerm tetrahedron_term(Vec3d a, Vec3d b, Vec3d c) {
  constexpr double kRoot2 = 1.41421356237309504880;
  const Vec3d sum = a + b + c;
  CornerTerm term;
  term.weight = kTetrahedronWeight;
  term.size = 2 * (dot(a, a) + dot(b, b) + dot(c, c)) - 0.5 * dot(sum, sum);
  term.size_gradient = -1.0 * sum;
  term.curvature = kTetrahedronCurvature;
  term.volume_gradient = kRoot2 * cross(c - a, b - a);
  term.volume = -dot(a, term.volume_gradient);
  return term;
}

/// The same against a tetrahedron of a reference mesh that is not flat, its nodes relative to each
/// other in the same order.
MESHSMOOTH_HD inline CornerTerm tetrahedron_term(Vec3d a, Vec3d b, Vec3d c,
                                                 const Vec3d (&target)[3]) {
  return term_of_edges<3>({a, b, c}, {0, 0, 0}, -1, corner_of_edges<3>(target), {0, 0, 0},
                          kTetrahedronWeight);
}
/// The same; `some_flat` as in `Targets`.
MESHSMOOTH_HD inline CornerTerm tetrahedron_term(Vec3d a, Vec3d b, Vec3d c,
                                                 const Vec3d (&target)[3],
                                                 const ElementShape& shape, bool some_flat) {
  if (!some_flat) return tetrahedron_term(a, b, c, target);
  const auto get = [&](int n) { return n == 0 ? Vec3d{0, 0, 0} : target[n - 1]; };
  return term_of_edges<3>({a, b, c}, {0, 0, 0}, -1, reference_corner<3>(shape, 0, true, get),
                          {0, 0, 0}, kTetrahedronWeight);
}

/// The local number of `node` in an element.
MESHSMOOTH_HD inline int local_node(const ElementView& element, NodeId node) {
  int own = 0;
  while (element.nodes[own] != node) ++own;
  return own;
}

/// Calls `visit(term)` for the corners that change when `node` moves, with the node at `position`:
/// one stands for all of a simplex, whose corners are equal. A team's thread takes the elements
/// `rank`, `rank + size`, …
template <int kDimension, class Team, class P, class Visitor>
MESHSMOOTH_HD void visit_terms(const Team& team, const Surroundings& around, const P& x,
                               std::size_t node, Vec3<typename P::Real> position, Vec3d normal,
                               const Visitor& visit) {
  const Vec3d own_position = vec3_cast<double>(position);
  const auto relative = [&](NodeId other) {
    return vec3_cast<double>(x[static_cast<std::size_t>(other)]) - own_position;
  };
  const Targets& targets = around.targets;
  if (kDimension == 3 && around.opposite != nullptr) {
    const std::int64_t last = around.balls.offsets[node + 1];
    for (std::int64_t e = around.balls.offsets[node] + team.rank; e < last; e += team.size) {
      const NodeId* const others = around.opposite + 3 * e;
      const Vec3d a = relative(others[0]), b = relative(others[1]), c = relative(others[2]);
      if (targets.reference == nullptr) {
        visit(tetrahedron_term(a, b, c));
        continue;
      }
      const Vec3d own = targets.reference[node];
      const Vec3d target[] = {targets.reference[others[0]] - own,
                              targets.reference[others[1]] - own,
                              targets.reference[others[2]] - own};
      visit(tetrahedron_term(a, b, c, target, *around.elements.runs[0].shape, targets.some_flat));
    }
    return;
  }
  const ElementId* const end = around.balls.end(node);
  for (const ElementId* e = around.balls.begin(node) + team.rank; e < end; e += team.size) {
    const ElementView element = around.elements[*e];
    const ElementShape& shape = *element.shape;
    const int own = local_node(element, static_cast<NodeId>(node));
    const auto get = [&](int n) { return n == own ? Vec3d{0, 0, 0} : relative(element.nodes[n]); };
    Vec3d reference{0, 0, 0};
    if constexpr (kDimension == 2) {
      reference = around.reference_of(*e);
      if (reference == Vec3d{0, 0, 0}) reference = normal;  // it had no area in the input
    }
    const auto visit_corner = [&](int k, int role) {
      visit(corner_term<kDimension>(shape, k, role, get,
                                    corner_target<kDimension>(targets, *e, element, k), reference));
    };
    if (is_simplex(shape)) {
      visit_corner(own, -1);
      continue;
    }
    for (int k = 0; k < shape.corner_count; ++k) {
      const int role = role_in_corner(shape.corners[k], own, kDimension);
      if (role < 3) visit_corner(k, role);
    }
  }
}

/// The terms of one node's ball, of one thread of a team. The first `kCapacity` are
/// stored; a larger ball is gathered again at every pass.
template <int kDimension, int kCapacity, class Team, class P>
class BallTerms {
 public:
  using Real = typename P::Real;
  static constexpr bool kTetrahedra = false;  // known to be all

  MESHSMOOTH_HD BallTerms(const Team& team, const Surroundings& around, const P& x,
                          std::size_t node, Vec3d normal)
      : team_(team), around_(around), x_(x), node_(node), normal_(normal) {
    move_to(x[node]);
  }

  /// Moves the node: displacements are relative to its new position.
  MESHSMOOTH_HD void move_to(Vec3<Real> position) {
    position_ = position;
    count_ = 0;
    gather([&](const CornerTerm& term) {
      if (count_ < kCapacity) kept_[count_] = term;
      ++count_;
    });
  }

  [[nodiscard]] MESHSMOOTH_HD Vec3<Real> position() const { return position_; }
  [[nodiscard]] MESHSMOOTH_HD const P& positions() const { return x_; }
  [[nodiscard]] MESHSMOOTH_HD double certainty() const { return around_.targets.certainty; }

  template <class Visitor>
  MESHSMOOTH_HD void for_each(const Visitor& visit) const {
    if (count_ > kCapacity) return gather(visit);
    for (int n = 0; n < count_; ++n) visit(kept_[n]);
  }

 private:
  template <class Visitor>
  MESHSMOOTH_HD void gather(const Visitor& visit) const {
    visit_terms<kDimension>(team_, around_, x_, node_, position_, normal_, visit);
  }

  const Team& team_;
  const Surroundings& around_;
  const P& x_;
  std::size_t node_;
  Vec3d normal_;
  Vec3<Real> position_;
  int count_ = 0;
  CornerTerm kept_[kCapacity];
};

}  // namespace meshsmooth::detail

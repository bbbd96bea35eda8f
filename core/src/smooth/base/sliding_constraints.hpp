#pragma once

#include <cmath>

#include "meshsmooth/vec3.hpp"
#include "smooth/base/topology.hpp"
#include "surface/surface_view.hpp"

namespace meshsmooth::detail {

/// How a boundary node may move: in a plane or along a line through `home`, its input position;
/// or, on curved parts, on the input facets: along a crease or on the part between creases.
struct NodeConstraint {
  enum Kind : std::uint8_t { point, line, plane, curve, surface };

  Vec3d home;
  Vec3d direction;  // unit: the line's, or the plane's normal
  Kind kind;
  bool off_target = false;    // it does not lie on its target yet: it moves freely, not on it
  NodeId next[2] = {-1, -1};  // curve: its neighbours on the crease
  std::int32_t target = -1;   // of `SlidingConstraints::surface`: where it belongs; -1: nowhere

  [[nodiscard]] MESHSMOOTH_HD bool curved() const { return kind == curve || kind == surface; }
  [[nodiscard]] MESHSMOOTH_HD bool along() const { return kind == line || kind == curve; }
};

/// A facet whose shape is preserved: on the boundary, or between two regions. Edges of surface
/// elements have two nodes.
struct ConstrainedFacet {
  NodeId nodes[4];     // seen from outside counter-clockwise; missing ones are -1
  Vec3d normal;        // of the input facet, as long as twice its area; an edge's own vector
  std::uint64_t name;  // from the caller's element: the order of sums
  bool between;        // two regions; seen from the lower one
};

/// The nodes of constrained facets, how they slide, and the facets around them, in executor
/// memory. Empty if no node may slide.
struct SlidingConstraints {
  static constexpr ElementId kNoFacet = ~ElementId{0};

  const std::int32_t* slots = nullptr;  // of a node, -1 for those on no constrained facet
  const NodeConstraint* node_constraints = nullptr;  // by slot
  Rows<ElementId> facets_of{};                       // by slot: the facets at the node
  const ConstrainedFacet* facets = nullptr;
  std::size_t facet_count = 0;
  bool curved = false;  // some parts are curved: all nodes slide on facets
  // If curved: for each of a facet's four edges (the k-th starts at node k) the facet that
  // continues beyond it without a crease, or kNoFacet.
  const ElementId* across = nullptr;
  SurfaceView surface{};  // where the job has a target surface

  [[nodiscard]] MESHSMOOTH_HD bool any() const { return slots != nullptr; }
  /// Whether facets keep their input orientation. On a target surface the elements at them tell
  /// what may not turn over: facets of the input may be folded.
  [[nodiscard]] MESHSMOOTH_HD bool keeps_orientation() const { return surface.patch_count == 0; }

  /// Null for a node that moves in space, or not at all.
  [[nodiscard]] MESHSMOOTH_HD const NodeConstraint* constraint(std::size_t node) const {
    return slots == nullptr || slots[node] < 0 ? nullptr : node_constraints + slots[node];
  }
  /// The input position of a node on a constrained facet.
  [[nodiscard]] MESHSMOOTH_HD Vec3d home(NodeId node) const {
    return node_constraints[slots[node]].home;
  }
};

/// Corners of a facet; two of an edge.
MESHSMOOTH_HD inline int corner_count(const ConstrainedFacet& facet) {
  return facet.nodes[2] < 0 ? 2 : facet.nodes[3] < 0 ? 3 : 4;
}

/// The node's index in the facet; -1 if it is not part of it.
MESHSMOOTH_HD inline int place_in(const ConstrainedFacet& facet, NodeId node) {
  for (int k = 0; k < corner_count(facet); ++k) {
    if (facet.nodes[k] == node) return k;
  }
  return -1;
}

/// The facet's normal at the positions `get(node)`, as long as twice its area; an edge's own
/// vector.
template <class Get>
MESHSMOOTH_HD Vec3d normal_of(const ConstrainedFacet& facet, const Get& get) {
  const NodeId* const nodes = facet.nodes;
  const Vec3d a = get(nodes[0]);
  if (nodes[2] < 0) return get(nodes[1]) - a;
  if (nodes[3] < 0) return cross(get(nodes[1]) - a, get(nodes[2]) - a);
  return cross(get(nodes[2]) - a, get(nodes[3]) - get(nodes[1]));
}

/// One coordinate of a position pulled back by `off`: where the direction is along an axis, a
/// coordinate is either free or fixed, and the fixed one keeps its bits.
MESHSMOOTH_HD inline double slid_coordinate(const NodeConstraint& constraint, double direction,
                                            double home, double position, double off) {
  const bool line = constraint.kind == NodeConstraint::line;
  if (direction == 0) return line ? home : position;
  if (std::abs(direction) == 1) return line ? position : home;
  return position - off;
}

/// The nearest position on the node's plane or line, to the rounding of the coordinates.
/// Computed from home every time, so that roundings do not accumulate.
template <class Real>
MESHSMOOTH_HD Vec3<Real> slide_to(const NodeConstraint& constraint, Vec3<Real> position) {
  const Vec3d p = vec3_cast<double>(position);
  const Vec3d h = constraint.home;
  const Vec3d n = constraint.direction;
  const Vec3d way = p - h;
  const Vec3d along = dot(n, way) * n;
  const Vec3d off = constraint.kind == NodeConstraint::line ? way - along : along;
  return vec3_cast<Real>(Vec3d{slid_coordinate(constraint, n.x, h.x, p.x, off.x),
                               slid_coordinate(constraint, n.y, h.y, p.y, off.y),
                               slid_coordinate(constraint, n.z, h.z, p.z, off.z)});
}

/// Whether a facet keeps its input orientation at the positions `get(node)`: no corner flipped, no
/// edge reversed; on curved parts turned by less than 60 degrees. A node whose facets keep it does
/// not leave the part of its plane or line that they cover.
template <class Get>
MESHSMOOTH_HD bool facet_is_right(const ConstrainedFacet& facet, bool curved, const Get& get) {
  const NodeId* const nodes = facet.nodes;
  const auto agrees = [&](Vec3d normal) {
    const double cosine = dot(normal, facet.normal);
    return cosine > 0 &&
           (!curved || 4 * cosine * cosine > dot(normal, normal) * dot(facet.normal, facet.normal));
  };
  if (nodes[2] < 0) return agrees(get(nodes[1]) - get(nodes[0]));
  const int count = nodes[3] < 0 ? 3 : 4;
  for (int k = 0; k < (count == 3 ? 1 : 4); ++k) {
    const Vec3d origin = get(nodes[k]);
    const Vec3d next = get(nodes[(k + 1) % count]) - origin;
    const Vec3d last = get(nodes[(k + count - 1) % count]) - origin;
    if (!agrees(cross(next, last))) return false;
  }
  return true;
}

/// Whether facet `f` is right at the positions `before`, but not `after`.
template <class Real>
MESHSMOOTH_HD bool facet_turns(const SlidingConstraints& sliding, std::size_t f,
                               const Vec3<Real>* before, const Vec3<Real>* after) {
  const auto is_right = [&](const Vec3<Real>* x) {
    return facet_is_right(sliding.facets[f], sliding.curved,
                          [=](NodeId n) { return vec3_cast<double>(x[n]); });
  };
  return sliding.keeps_orientation() && !is_right(after) && is_right(before);
}

/// Whether every facet at the node that keeps its orientation still does with the node moved.
template <class Team, class P>
MESHSMOOTH_HD bool keeps_facets(const Team& team, const SlidingConstraints& sliding, const P& x,
                                std::size_t node, Vec3<typename P::Real> position) {
  if (sliding.constraint(node) == nullptr || !sliding.keeps_orientation()) return true;
  const auto slot = static_cast<std::size_t>(sliding.slots[node]);
  const auto lies = [&](NodeId n) { return vec3_cast<double>(x[static_cast<std::size_t>(n)]); };
  const auto would_lie = [&](NodeId n) {
    return static_cast<std::size_t>(n) == node ? vec3_cast<double>(position) : lies(n);
  };
  bool right = true;
  const ElementId* const end = sliding.facets_of.end(slot);
  for (const ElementId* f = sliding.facets_of.begin(slot) + team.rank; right && f < end;
       f += team.size) {
    const ConstrainedFacet& facet = sliding.facets[*f];
    right = facet_is_right(facet, sliding.curved, would_lie) ||
            !facet_is_right(facet, sliding.curved, lies);
  }
  return team.all(right);
}

}  // namespace meshsmooth::detail

#pragma once

#include <cmath>

#include "meshsmooth/vec3.hpp"
#include "smooth/topology.hpp"

namespace meshsmooth::detail {

/// How a boundary node may move: in a plane or along a line through `home`, where the
/// caller had it.
struct Freedom {
  enum Kind : std::uint8_t { point, line, plane };

  Vec3d home;
  Vec3d direction;  // unit: the line's, or the plane's normal
  Kind kind;
};

/// A facet that keeps its place: on the boundary, or between two regions. Edges of surface
/// elements have two nodes.
struct KeptFacet {
  NodeId nodes[4];     // seen from outside counter-clockwise; missing ones are -1
  Vec3d normal;        // of the facet as it came, as long as twice its area; an edge's own vector
  std::uint64_t name;  // by the caller's element: the order of sums
  bool between;        // two regions; seen from the lower one
};

/// The nodes that slide, and the facets around them, in executor memory. Empty where none
/// may.
struct Slides {
  const std::int32_t* slots = nullptr;  // of a node, -1 for those without a freedom
  const Freedom* freedoms = nullptr;    // by slot
  Rows<ElementId> facets_of{};          // by slot: the facets at the node
  const KeptFacet* facets = nullptr;
  std::size_t facet_count = 0;

  [[nodiscard]] MESHSMOOTH_HD bool any() const { return slots != nullptr; }

  /// Null for a node that moves in space, or not at all.
  [[nodiscard]] MESHSMOOTH_HD const Freedom* freedom(std::size_t node) const {
    return slots == nullptr || slots[node] < 0 ? nullptr : freedoms + slots[node];
  }
};

/// One coordinate of a place drawn back by `off`: where the direction lies along an axis a
/// coordinate is either free or fixed, and the fixed one keeps its bits.
MESHSMOOTH_HD inline double slid_coordinate(const Freedom& freedom, double direction, double home,
                                            double place, double off) {
  const bool line = freedom.kind == Freedom::line;
  if (direction == 0) return line ? home : place;
  if (std::abs(direction) == 1) return line ? place : home;
  return place - off;
}

/// The place of the freedom that is nearest to `place`, to the rounding of the coordinates.
/// Counted from home every time, so that roundings do not add up.
template <class Real>
MESHSMOOTH_HD Vec3<Real> slide_to(const Freedom& freedom, Vec3<Real> place) {
  const Vec3d p = vec3_cast<double>(place);
  const Vec3d h = freedom.home;
  const Vec3d n = freedom.direction;
  const Vec3d way = p - h;
  const Vec3d along = dot(n, way) * n;
  const Vec3d off = freedom.kind == Freedom::line ? way - along : along;
  return vec3_cast<Real>(Vec3d{slid_coordinate(freedom, n.x, h.x, p.x, off.x),
                               slid_coordinate(freedom, n.y, h.y, p.y, off.y),
                               slid_coordinate(freedom, n.z, h.z, p.z, off.z)});
}

/// Whether a facet lies as it came: every corner turned the same way, an edge not reversed.
/// `get(node)` gives positions in double. A node in a plane, or on a line, whose facets
/// keep this does not leave the part of it that they cover.
template <class Get>
MESHSMOOTH_HD bool facet_is_right(const KeptFacet& facet, const Get& get) {
  const NodeId* const nodes = facet.nodes;
  if (nodes[2] < 0) return dot(get(nodes[1]) - get(nodes[0]), facet.normal) > 0;
  const int count = nodes[3] < 0 ? 3 : 4;
  for (int k = 0; k < (count == 3 ? 1 : 4); ++k) {
    const Vec3d origin = get(nodes[k]);
    const Vec3d next = get(nodes[(k + 1) % count]) - origin;
    const Vec3d last = get(nodes[(k + count - 1) % count]) - origin;
    if (!(dot(cross(next, last), facet.normal) > 0)) return false;
  }
  return true;
}

/// Whether every facet at the node that is right stays so when it goes to `place`.
template <class Team, class P>
MESHSMOOTH_HD bool keeps_facets(const Team& team, const Slides& slides, const P& x,
                                std::size_t node, Vec3<typename P::Real> place) {
  if (slides.freedom(node) == nullptr) return true;
  const auto slot = static_cast<std::size_t>(slides.slots[node]);
  const auto lies = [&](NodeId n) { return vec3_cast<double>(x[static_cast<std::size_t>(n)]); };
  const auto would_lie = [&](NodeId n) {
    return static_cast<std::size_t>(n) == node ? vec3_cast<double>(place) : lies(n);
  };
  bool right = true;
  const ElementId* const end = slides.facets_of.end(slot);
  for (const ElementId* f = slides.facets_of.begin(slot) + team.rank; right && f < end;
       f += team.size) {
    const KeptFacet& facet = slides.facets[*f];
    right = facet_is_right(facet, would_lie) || !facet_is_right(facet, lies);
  }
  return team.all(right);
}

}  // namespace meshsmooth::detail

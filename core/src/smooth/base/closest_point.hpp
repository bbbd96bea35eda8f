#pragma once

#include "smooth/base/sliding_constraints.hpp"
#include "surface/closest.hpp"

namespace meshsmooth::detail {

/// Of a facet; one with four nodes is the two triangles on its diagonal 0-2.
template <class Get>
MESHSMOOTH_HD Closest closest_on_facet(const ConstrainedFacet& facet, Vec3d p, const Get& get) {
  const NodeId* const nodes = facet.nodes;
  const Vec3d a = get(nodes[0]);
  if (nodes[2] < 0) return closest_on_segment(a, get(nodes[1]), p);
  const Vec3d c = get(nodes[2]);
  Closest best = closest_on_triangle(a, get(nodes[1]), c, p);
  if (nodes[3] < 0) return best;
  if (best.at == 2) best.at = -1;  // the diagonal
  Closest other = closest_on_triangle(a, c, get(nodes[3]), p);
  if (!(other.squared < best.squared)) return best;
  constexpr int kAtInQuad[] = {-1, 2, 3, -1, 4, 6, 7};
  if (other.at >= 0) other.at = kAtInQuad[other.at];
  return other;
}

/// A position on the facets, and its facet.
struct OnFacets {
  Closest closest;
  ElementId facet = SlidingConstraints::kNoFacet;
};

/// Walks over the facets around one of their nodes, across edges that are no creases. On a surface
/// that cannot be oriented two facets may run round the node in different directions.
class FanWalk {
 public:
  /// @param way  0: first across the edge that starts at the node, 1: that ends there
  MESHSMOOTH_HD FanWalk(const SlidingConstraints& sliding, ElementId facet, NodeId node, int way)
      : sliding_(sliding), facet_(facet), node_(node) {
    const ConstrainedFacet& f = sliding.facets[facet];
    const int count = corner_count(f);
    from_ = f.nodes[(place_in(f, node) + (way == 0 ? count - 1 : 1)) % count];
  }

  [[nodiscard]] MESHSMOOTH_HD ElementId facet() const { return facet_; }

  /// To the next facet, or kNoFacet.
  MESHSMOOTH_HD void step() {
    const ConstrainedFacet& f = sliding_.facets[facet_];
    const int count = corner_count(f);
    const int own = place_in(f, node_);
    const int next = (own + 1) % count, last = (own + count - 1) % count;
    const bool forward = f.nodes[last] == from_;
    from_ = f.nodes[forward ? next : last];
    facet_ = sliding_.across[4 * std::size_t{facet_} + (forward ? own : last)];
  }

 private:
  const SlidingConstraints& sliding_;
  ElementId facet_;
  NodeId node_;
  NodeId from_;  // the other end of the edge across which the facet was entered
};

/// The sign by which a facet's normal points to the side of that of the first facet at a node. Of a
/// smooth fan that is oriented always 1.
MESHSMOOTH_HD inline double sign_at(const SlidingConstraints& sliding, ElementId first,
                                    ElementId facet) {
  return dot(sliding.facets[facet].normal, sliding.facets[first].normal) < 0 ? -1.0 : 1.0;
}

/// Bound on the steps of a search. It starts at the node's input facets and continues while the
/// distance falls, so it may end in a local minimum; but always on the facets.
inline constexpr int kMostSteps = 64;

/// Searches from the facets at a node, where it is at `start`, across edges that are no creases.
/// `get(node)` gives the positions of the facets' nodes.
///
/// cost   the facets at the node, and those on the path
template <class Get>
MESHSMOOTH_HD OnFacets closest_on_patch(const SlidingConstraints& sliding, std::size_t node,
                                        Vec3d start, Vec3d p, const Get& get) {
  const auto slot = static_cast<std::size_t>(sliding.slots[node]);
  OnFacets best{closest_at(start, p, -1)};
  const auto look_at = [&](ElementId facet) {
    const Closest found = closest_on_facet(sliding.facets[facet], p, get);
    if (!(found.squared < best.closest.squared)) return false;
    best = {found, facet};
    return true;
  };
  // The facets around a corner of a facet, in both directions until a crease.
  const auto look_around = [&](ElementId first, NodeId corner) {
    bool nearer = false;
    for (int way = 0; way < 2; ++way) {
      FanWalk walk(sliding, first, corner, way);
      for (int step = 0; step < kMostSteps; ++step) {
        walk.step();
        if (walk.facet() == SlidingConstraints::kNoFacet || walk.facet() == first) break;
        nearer = look_at(walk.facet()) || nearer;
      }
      if (walk.facet() == first) break;
    }
    return nearer;
  };
  for (const ElementId* f = sliding.facets_of.begin(slot); f != sliding.facets_of.end(slot); ++f) {
    look_at(*f);
  }
  for (int step = 0; step < kMostSteps && best.closest.at >= 0; ++step) {
    const ElementId from = best.facet;
    const int at = best.closest.at;
    if (at >= 4) {
      if (!look_around(from, sliding.facets[from].nodes[at - 4])) break;
    } else {
      const ElementId other = sliding.across[4 * std::size_t{from} + at];
      if (other == SlidingConstraints::kNoFacet || !look_at(other)) break;
    }
  }
  return best;
}

/// The same along the node's crease, up to the corners.
template <class Get>
MESHSMOOTH_HD Closest closest_on_crease(const SlidingConstraints& sliding, std::size_t node,
                                        Vec3d start, Vec3d p, const Get& get) {
  Closest best = closest_at(start, p, -1);
  for (const NodeId first : sliding.constraint(node)->next) {
    NodeId from = static_cast<NodeId>(node), to = first;
    for (int step = 0; step < kMostSteps; ++step) {
      const Closest found = closest_on_segment(get(from), get(to), p);
      if (!(found.squared < best.squared)) break;
      best = found;
      const NodeConstraint& beyond = *sliding.constraint(static_cast<std::size_t>(to));
      if (found.at != 5 || beyond.kind != NodeConstraint::curve) break;
      const NodeId last = from;
      from = to;
      to = beyond.next[beyond.next[0] == last ? 1 : 0];
    }
  }
  return best;
}

/// The same on a curved constraint of either kind.
template <class Get>
MESHSMOOTH_HD Closest closest_of_constraint(const SlidingConstraints& sliding, std::size_t node,
                                            Vec3d start, Vec3d p, const Get& get) {
  return sliding.constraint(node)->kind == NodeConstraint::curve
             ? closest_on_crease(sliding, node, start, p, get)
             : closest_on_patch(sliding, node, start, p, get).closest;
}

/// The nearest position on the node's target or, without one, on its input crease or part. There
/// always searched from the node's home, so that it depends on nothing else and roundings do not
/// accumulate.
MESHSMOOTH_HD inline Vec3d project(const SlidingConstraints& sliding, std::size_t node,
                                   Vec3d position) {
  const NodeConstraint& constraint = *sliding.constraint(node);
  if (constraint.target >= 0) {
    return constraint.off_target ? position
                                 : closest_on_entity(sliding.surface, constraint.target, position);
  }
  const Vec3d home = constraint.home;
  return closest_of_constraint(sliding, node, home, position,
                               [&](NodeId n) { return sliding.home(n); })
      .position;
}

/// The direction of the node's crease, or the normal of its part, at the current positions; zero
/// if there is none.
template <class P>
MESHSMOOTH_OUTLINE MESHSMOOTH_HD Vec3d direction_on_facets(const SlidingConstraints& sliding,
                                                           std::size_t node, const P& x) {
  const auto get = [&](NodeId n) { return vec3_cast<double>(x[static_cast<std::size_t>(n)]); };
  const NodeConstraint& constraint = *sliding.constraint(node);
  Vec3d sum{0, 0, 0};
  if (constraint.kind == NodeConstraint::curve) {
    sum = get(constraint.next[1]) - get(constraint.next[0]);
  } else {
    const auto slot = static_cast<std::size_t>(sliding.slots[node]);
    for (const ElementId* f = sliding.facets_of.begin(slot); f != sliding.facets_of.end(slot);
         ++f) {
      sum +=
          sign_at(sliding, *sliding.facets_of.begin(slot), *f) * normal_of(sliding.facets[*f], get);
    }
  }
  const double length = norm(sum);
  return length > 0 ? Vec3d{sum.x / length, sum.y / length, sum.z / length} : Vec3d{0, 0, 0};
}

}  // namespace meshsmooth::detail

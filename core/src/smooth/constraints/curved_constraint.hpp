#pragma once

#include <cmath>

#include "smooth/base/closest_point.hpp"
#include "smooth/constraints/node_constraint.hpp"

namespace meshsmooth::detail {

/// Whether two facets turn by less than an angle below 90 degrees; by that between their planes
/// where the surface cannot be oriented.
MESHSMOOTH_HD inline bool goes_on(const ConstrainedFacet& a, const ConstrainedFacet& b,
                                  double angle_cos, bool oriented = true) {
  const double signed_cosine = dot(a.normal, b.normal);
  const double cosine = oriented ? signed_cosine : std::abs(signed_cosine);
  return cosine > 0 && cosine >= angle_cos * (norm(a.normal) * norm(b.normal));
}

/// Whether two facets have their common edge in opposite directions, as seen from the same side. A
/// surface that cannot be oriented, as a Moebius strip, is cut where they do not.
MESHSMOOTH_HD inline bool opposed(const ConstrainedFacet& a, const ConstrainedFacet& b, NodeId from,
                                  NodeId to) {
  const auto leads = [&](const ConstrainedFacet& facet) {
    return facet.nodes[(place_in(facet, from) + 1) % corner_count(facet)] == to;
  };
  return leads(a) != leads(b);
}

/// The facet beyond the k-th edge of a facet; kNoFacet at a crease, where two facets turn by more
/// than the feature angle or not exactly two meet.
MESHSMOOTH_HD inline ElementId facet_across(const SlidingConstraints& sliding, ElementId facet,
                                            int k, const NodeConstraintRule& rule) {
  const ConstrainedFacet& own = sliding.facets[facet];
  const int count = corner_count(own);
  if (k >= count) return SlidingConstraints::kNoFacet;
  const NodeId a = own.nodes[k], b = own.nodes[(k + 1) % count];
  ElementId other = SlidingConstraints::kNoFacet;
  // Searched at the end with fewer facets: the other one may be a hub.
  const auto slot_of_a = static_cast<std::size_t>(sliding.slots[a]);
  const auto slot_of_b = static_cast<std::size_t>(sliding.slots[b]);
  const bool at_a = sliding.facets_of.size(slot_of_a) <= sliding.facets_of.size(slot_of_b);
  const std::size_t slot = at_a ? slot_of_a : slot_of_b;
  for (const ElementId* f = sliding.facets_of.begin(slot); f != sliding.facets_of.end(slot); ++f) {
    if (*f == facet || place_in(sliding.facets[*f], at_a ? b : a) < 0) continue;
    if (other != SlidingConstraints::kNoFacet) return SlidingConstraints::kNoFacet;
    other = *f;
  }
  if (other == SlidingConstraints::kNoFacet) return other;
  const ConstrainedFacet& beyond = sliding.facets[other];
  return goes_on(own, beyond, rule.feature_angle_cos, opposed(own, beyond, a, b))
             ? other
             : SlidingConstraints::kNoFacet;
}

/// The constraint that the facets around a node leave.
struct CurvedConstraint {
  NodeConstraint constraint;
  bool corner = false;  // where creases meet, or one turns
};

/// The constraint of a node by the creases between the facets around it. Without a crease it moves
/// on the facets, if they are one fan and every two turn by less than the rule allows (at a hub
/// each from the mean by less than half as much); with two creases that continue at less than the
/// feature angle, along them.
class FacetsAtNode {
 public:
  MESHSMOOTH_HD FacetsAtNode(const SlidingConstraints& sliding, std::size_t node,
                             const NodeConstraintRule& rule)
      : sliding_(sliding),
        node_(static_cast<NodeId>(node)),
        begin_(sliding.facets_of.begin(static_cast<std::size_t>(sliding.slots[node]))),
        end_(sliding.facets_of.end(static_cast<std::size_t>(sliding.slots[node]))),
        rule_(rule) {}

  [[nodiscard]] MESHSMOOTH_HD CurvedConstraint find() const {
    const Vec3d home = sliding_.home(node_);
    CurvedConstraint result{{home, {0, 0, 0}, NodeConstraint::point}};
    NodeConstraint& found = result.constraint;
    NodeId ends[2] = {-1, -1};
    const int creases = find_creases(ends);
    if (creases == 0 && one_smooth_fan()) found.kind = NodeConstraint::surface;
    if (creases == 2) {
      const Vec3d to = home - sliding_.home(ends[0]);
      const Vec3d on = sliding_.home(ends[1]) - home;
      const double cosine = dot(to, on);
      if (cosine > 0 && cosine >= rule_.feature_angle_cos * (norm(to) * norm(on))) {
        found.kind = NodeConstraint::curve;
        found.next[0] = ends[0];
        found.next[1] = ends[1];
      }
    }
    result.corner = creases > 1 && found.kind == NodeConstraint::point;
    return result;
  }

 private:
  /// How many edges at the node are creases, up to 3; the first two lead to `ends`.
  [[nodiscard]] MESHSMOOTH_HD int find_creases(NodeId* ends) const {
    int creases = 0;
    for (const ElementId* f = begin_; f != end_; ++f) {
      const ConstrainedFacet& facet = sliding_.facets[*f];
      const int count = corner_count(facet);
      const int own = place_in(facet, node_);
      for (int side = 0; side < 2; ++side) {
        const int edge = side == 0 ? own : (own + count - 1) % count;
        if (sliding_.across[4 * std::size_t{*f} + edge] != SlidingConstraints::kNoFacet) continue;
        const NodeId other = facet.nodes[side == 0 ? (own + 1) % count : edge];
        if (other == ends[0] || other == ends[1]) continue;
        if (creases < 2) ends[creases] = other;
        if (++creases > 2) return creases;
      }
    }
    return creases;
  }

  /// Whether every two facets turn by less than the fan angle. At a hub, where all pairs would be
  /// too many, whether each turns from the mean by less than half of it, which implies that.
  [[nodiscard]] MESHSMOOTH_HD bool any_two_go_on() const {
    constexpr std::ptrdiff_t kMostFacets = 256;
    const bool oriented = is_oriented();
    if (end_ - begin_ <= kMostFacets) {
      for (const ElementId* f = begin_; f != end_; ++f) {
        for (const ElementId* g = begin_; g != f; ++g) {
          if (!goes_on(sliding_.facets[*f], sliding_.facets[*g], rule_.fan_angle_cos, oriented)) {
            return false;
          }
        }
      }
      return true;
    }
    ConstrainedFacet mean{};
    for (const ElementId* f = begin_; f != end_; ++f) {
      mean.normal += sign_at(sliding_, *begin_, *f) * sliding_.facets[*f].normal;
    }
    const double half_angle_cos = std::sqrt((1 + rule_.fan_angle_cos) / 2);
    for (const ElementId* f = begin_; f != end_; ++f) {
      if (!goes_on(sliding_.facets[*f], mean, half_angle_cos, oriented)) return false;
    }
    return true;
  }

  [[nodiscard]] MESHSMOOTH_HD bool one_smooth_fan() const {
    if (!any_two_go_on()) return false;
    const auto count = static_cast<int>(end_ - begin_);
    int seen = 0;
    FanWalk walk(sliding_, *begin_, node_, 0);
    do {
      walk.step();
    } while (++seen < count && walk.facet() != *begin_);
    return seen == count && walk.facet() == *begin_;
  }

  /// Whether no two facets beside each other at the node have their edge in the same direction.
  [[nodiscard]] MESHSMOOTH_HD bool is_oriented() const {
    for (const ElementId* f = begin_; f != end_; ++f) {
      const ConstrainedFacet& facet = sliding_.facets[*f];
      const int own = place_in(facet, node_);
      const ElementId other = sliding_.across[4 * std::size_t{*f} + own];
      if (other == SlidingConstraints::kNoFacet) continue;
      const NodeId to = facet.nodes[(own + 1) % corner_count(facet)];
      if (!opposed(facet, sliding_.facets[other], node_, to)) return false;
    }
    return true;
  }

  const SlidingConstraints& sliding_;
  NodeId node_;
  const ElementId* begin_;
  const ElementId* end_;
  const NodeConstraintRule& rule_;
};

/// The constraint of a node of a surface mesh whose two edges continue each other.
MESHSMOOTH_HD inline CurvedConstraint find_constraint_on_edges(const SlidingConstraints& sliding,
                                                               std::size_t node) {
  const auto id = static_cast<NodeId>(node);
  NodeConstraint found{sliding.home(id), {0, 0, 0}, NodeConstraint::curve};
  const ElementId* const edges =
      sliding.facets_of.begin(static_cast<std::size_t>(sliding.slots[node]));
  for (int k = 0; k < 2; ++k) {
    const ConstrainedFacet& edge = sliding.facets[edges[k]];
    found.next[k] = edge.nodes[edge.nodes[0] == id ? 1 : 0];
  }
  return {found};
}

}  // namespace meshsmooth::detail

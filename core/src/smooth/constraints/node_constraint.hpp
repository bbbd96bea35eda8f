#pragma once

#include <cmath>

#include "smooth/base/sliding_constraints.hpp"

namespace meshsmooth::detail {

/// Tolerances for finding constraints.
struct NodeConstraintRule {
  double flatness;           // a part is planar if no node is farther from its plane
  double feature_angle_cos;  // facets that turn by less belong to a curved part
  double fan_angle_cos;      // as any two at a node without a crease must: else it is a tip
};

/// The planes of the constrained facets at a node, by area: each next one is that of the largest
/// facet in none of the earlier ones. A node in one plane may slide in it, in two along their
/// common line, in more only if all of them contain that line. `NodeConstraint::surface` only means
/// that a part around the node is curved.
///
/// Planes are distinguished by the distances of the facets' nodes, not by normals, which are
/// unreliable for slivers. Planes that meet at less than the feature angle count as a curved part;
/// so do warped facets with four nodes. Two boundary facets back to back are a slit, whose front
/// is fixed. `get(node)` gives positions in double.
template <class Get>
class PlanesAtNode {
 public:
  MESHSMOOTH_HD PlanesAtNode(const ConstrainedFacet* facets, const ElementId* begin,
                             const ElementId* end, Vec3d home, const Get& get,
                             const NodeConstraintRule& rule)
      : facets_(facets), begin_(begin), end_(end), home_(home), get_(get), rule_(rule) {}

  [[nodiscard]] MESHSMOOTH_HD NodeConstraint find() {
    const NodeConstraint fixed{home_, {0, 0, 0}, NodeConstraint::point};
    NodeConstraint found = fixed;
    for (int count = 0;; ++count) {
      const ConstrainedFacet* const largest = largest_outside();
      if (largest == nullptr) return found;
      if (count == kMostPlanes) return fixed;
      const Vec3d normal = average_normal(unit(largest->normal));
      if (normal == Vec3d{0, 0, 0}) return fixed;
      if (!lies_in(*largest, normal)) return curved();  // a facet that is warped itself
      for (int k = 0; k < count; ++k) {
        if (std::abs(dot(normal, normals_[k])) > rule_.feature_angle_cos) return curved();
      }
      normals_[count] = normal;
      plane_count_ = count + 1;
      if (count == 0) {
        found = {home_, normal, NodeConstraint::plane};
      } else if (count == 1) {
        found = {home_, unit(cross(normals_[0], normal)), NodeConstraint::line};
      } else if (!shares_line(normal, found.direction)) {
        return fixed;
      }
    }
  }

 private:
  static constexpr int kMostPlanes = 4;

  [[nodiscard]] MESHSMOOTH_HD NodeConstraint curved() const {
    return {home_, {0, 0, 0}, NodeConstraint::surface};
  }

  /// Divided, not multiplied by the inverse: an axis stays one exactly.
  static MESHSMOOTH_HD Vec3d unit(Vec3d v) {
    const double length = norm(v);
    return length > 0 ? Vec3d{v.x / length, v.y / length, v.z / length} : Vec3d{0, 0, 0};
  }

  [[nodiscard]] MESHSMOOTH_HD bool lies_in(const ConstrainedFacet& facet, Vec3d normal) const {
    for (const NodeId n : facet.nodes) {
      if (n >= 0 && !(std::abs(dot(get_(n) - home_, normal)) <= rule_.flatness)) return false;
    }
    return true;
  }

  [[nodiscard]] MESHSMOOTH_HD const ConstrainedFacet* largest_outside() const {
    const ConstrainedFacet* largest = nullptr;
    double largest_squared = 0;
    for (const ElementId* f = begin_; f != end_; ++f) {
      const ConstrainedFacet& facet = facets_[*f];
      bool inside = false;
      for (int k = 0; k < plane_count_; ++k) inside = inside || lies_in(facet, normals_[k]);
      const double squared = dot(facet.normal, facet.normal);
      if (inside || !(squared > largest_squared)) continue;
      largest = &facet;
      largest_squared = squared;
    }
    return largest;
  }

  /// The mean normal of the facets in the plane with this normal; zero for a slit.
  [[nodiscard]] MESHSMOOTH_HD Vec3d average_normal(Vec3d normal) const {
    Vec3d sum{0, 0, 0};
    bool ahead = false, behind = false;
    for (const ElementId* f = begin_; f != end_; ++f) {
      const ConstrainedFacet& facet = facets_[*f];
      if (!lies_in(facet, normal)) continue;
      const bool against = dot(facet.normal, normal) < 0;
      if (!facet.between) (against ? behind : ahead) = true;
      sum += (against ? -1.0 : 1.0) * facet.normal;
    }
    if (ahead && behind) return {0, 0, 0};
    return sum == Vec3d{0, 0, 0} ? normal : unit(sum);
  }

  /// Whether a step along the line, as long as the facets, stays in the plane.
  [[nodiscard]] MESHSMOOTH_HD bool shares_line(Vec3d normal, Vec3d line) const {
    double reach = 0;
    for (const ElementId* f = begin_; f != end_; ++f) {
      for (const NodeId n : facets_[*f].nodes) {
        if (n < 0) continue;
        const double distance = norm(get_(n) - home_);
        if (distance > reach) reach = distance;
      }
    }
    return std::abs(dot(normal, line)) * reach <= rule_.flatness;
  }

  const ConstrainedFacet* facets_;
  const ElementId* begin_;
  const ElementId* end_;
  Vec3d home_;
  const Get& get_;
  const NodeConstraintRule& rule_;
  Vec3d normals_[kMostPlanes];
  int plane_count_ = 0;
};

/// The constraint of a node of a surface mesh by the edges around it: two that continue straight
/// are a line, at less than the feature angle a curve.
template <class Get>
MESHSMOOTH_HD NodeConstraint find_constraint_on_surface(const ConstrainedFacet* edges,
                                                        std::size_t node, const ElementId* begin,
                                                        const ElementId* end, Vec3d home,
                                                        const Get& get,
                                                        const NodeConstraintRule& rule) {
  NodeConstraint found{home, {0, 0, 0}, NodeConstraint::point};
  if (end - begin != 2) return found;
  const auto to_other = [&](const ConstrainedFacet& edge) {
    return get(edge.nodes[edge.nodes[0] == static_cast<NodeId>(node) ? 1 : 0]) - home;
  };
  const Vec3d a = to_other(edges[begin[0]]);
  const Vec3d b = to_other(edges[begin[1]]);
  const Vec3d whole = a - b;
  const double length = norm(whole);
  if (!(length > 0) || !(dot(a, b) < 0)) return found;
  const Vec3d direction{whole.x / length, whole.y / length, whole.z / length};
  if (norm(cross(a, direction)) <= rule.flatness && norm(cross(b, direction)) <= rule.flatness) {
    found = {home, direction, NodeConstraint::line};
  } else if (-dot(a, b) > rule.feature_angle_cos * (norm(a) * norm(b))) {
    found.kind = NodeConstraint::curve;
  }
  return found;
}

}  // namespace meshsmooth::detail

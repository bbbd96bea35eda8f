#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "support/oracle.hpp"

namespace meshsmooth::test {

using Triangle = std::array<oracle::Point, 3>;

inline double distance_to_segment(const oracle::Point& a, const oracle::Point& b,
                                  const oracle::Point& p) {
  const oracle::Point way = b - a;
  const double whole = way.squaredNorm();
  const double share = whole > 0 ? std::clamp(way.dot(p - a) / whole, 0.0, 1.0) : 0.0;
  return (p - (a + share * way)).norm();
}

/// To its plane where p lies over it, else to its sides.
inline double distance_to_triangle(const Triangle& t, const oracle::Point& p) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    least = std::min(least, distance_to_segment(t[k], t[(k + 1) % 3], p));
  }
  const oracle::Point normal = (t[1] - t[0]).cross(t[2] - t[0]);
  if (normal.norm() == 0) return least;
  for (int k = 0; k < 3; ++k) {
    const oracle::Point side = t[(k + 1) % 3] - t[k];
    if (normal.dot(side.cross(p - t[k])) < 0) return least;
  }
  return std::min(least, std::abs(normal.normalized().dot(p - t[0])));
}

/// The facets on the boundary and between regions, by their nodes in the order that the
/// element (between regions that of the lower one) lists them; of a surface mesh edges.
inline std::vector<std::vector<NodeId>> constrained_facets(const Mesh& mesh) {
  struct Use {
    int region;
    std::vector<NodeId> nodes;
  };
  std::map<std::set<NodeId>, std::vector<Use>> uses;
  std::size_t id = 0;
  for (const oracle::Element& element : oracle::elements(mesh)) {
    const int region = mesh.regions.empty() ? 0 : mesh.regions[id];
    ++id;
    const ElementShape& shape = element_shape(element.type);
    for (int f = 0; f < shape.facet_count; ++f) {
      std::vector<NodeId> nodes;
      for (int k = 0; k < shape.facets[f].node_count; ++k) {
        nodes.push_back(element.nodes[static_cast<std::size_t>(shape.facets[f].nodes[k])]);
      }
      uses[{nodes.begin(), nodes.end()}].push_back({region, nodes});
    }
  }
  std::vector<std::vector<NodeId>> result;
  for (const auto& [key, of] : uses) {
    if (of.size() == 1) {
      result.push_back(of[0].nodes);
    } else if (of[0].region != of[1].region) {
      result.push_back(of[of[0].region < of[1].region ? 0 : 1].nodes);
    }
  }
  return result;
}

/// The constrained facets of a volume mesh, or the elements of a surface mesh, as triangles, those
/// of four nodes cut on the diagonal from their first: every distance by looking at all.
class InputSurface {
 public:
  explicit InputSurface(const Mesh& mesh) {
    const oracle::Points x = oracle::to_points(mesh);
    std::vector<std::vector<NodeId>> facets;
    if (oracle::is_surface(mesh.blocks[0].type)) {
      for (const oracle::Element& element : oracle::elements(mesh)) facets.push_back(element.nodes);
    } else {
      facets = constrained_facets(mesh);
    }
    for (const std::vector<NodeId>& nodes : facets) {
      for (std::size_t k = 2; k < nodes.size(); ++k) {
        triangles_.push_back({x[nodes[0]], x[nodes[k - 1]], x[nodes[k]]});
      }
    }
  }

  [[nodiscard]] double distance(const oracle::Point& p) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle& t : triangles_) least = std::min(least, distance_to_triangle(t, p));
    return least;
  }

 private:
  std::vector<Triangle> triangles_;
};

}  // namespace meshsmooth::test

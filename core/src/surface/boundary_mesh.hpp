#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/vec3.hpp"
#include "surface/checkpoint.hpp"

namespace meshsmooth::detail {

/// A facet of a mesh's boundary, counter-clockwise from outside; of a triangle the fourth is -1.
using BoundaryFacet = std::array<std::int32_t, 4>;

/// An edge of the boundary.
struct BoundaryEdge {
  std::int32_t nodes[2];
  std::int32_t facets[2];  // -1: none; of more than two the first
  double length;
  bool crease;  // its facets turn by more than the feature angle
};

/// The boundary of a mesh as a graph. Nodes are numbered from 0 on.
class BoundaryMesh {
 public:
  /// O(facets log facets).
  ///
  /// takes  `check`, called now and then; what it throws ends the constructor
  BoundaryMesh(std::vector<Vec3d> points, std::vector<BoundaryFacet> facets, double feature_angle,
               const std::function<void()>& check);

  [[nodiscard]] std::size_t node_count() const { return points_.size(); }
  [[nodiscard]] std::span<const Vec3d> points() const { return points_; }
  [[nodiscard]] std::span<const BoundaryFacet> facets() const { return facets_; }
  [[nodiscard]] std::span<const BoundaryEdge> edges() const { return edges_; }
  /// The edges of a facet; of a triangle the fourth is -1.
  [[nodiscard]] const std::array<std::int32_t, 4>& edges_of(std::int32_t facet) const {
    return edges_of_[std::size_t(facet)];
  }
  /// The edges at a node.
  [[nodiscard]] std::span<const std::int32_t> edges_at(std::int32_t node) const {
    const auto n = std::size_t(node);
    return std::span(edge_ids_).subspan(first_[n], first_[n + 1] - first_[n]);
  }
  [[nodiscard]] std::int32_t other_end(std::int32_t edge, std::int32_t node) const {
    const BoundaryEdge& e = edges_[std::size_t(edge)];
    return e.nodes[e.nodes[0] == node ? 1 : 0];
  }
  /// The mean length of the edges at a node.
  [[nodiscard]] double size_at(std::int32_t node) const { return sizes_[std::size_t(node)]; }
  /// How many creases end at a node.
  [[nodiscard]] int crease_count(std::int32_t node) const;

  [[nodiscard]] Vec3d centre(const BoundaryFacet& facet) const;
  /// As long as twice the area.
  [[nodiscard]] Vec3d normal(const BoundaryFacet& facet) const;

 private:
  void find_edges(double feature_angle, Checkpoint& checkpoint);

  std::vector<Vec3d> points_;
  std::vector<BoundaryFacet> facets_;
  std::vector<BoundaryEdge> edges_;
  std::vector<std::array<std::int32_t, 4>> edges_of_;  // by facet
  std::vector<std::size_t> first_;
  std::vector<std::int32_t> edge_ids_;
  std::vector<double> sizes_;
};

}  // namespace meshsmooth::detail

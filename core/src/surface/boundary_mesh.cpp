#include "surface/boundary_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

namespace meshsmooth::detail {
namespace {

[[nodiscard]] std::size_t corner_count(const BoundaryFacet& facet) { return facet[3] < 0 ? 3 : 4; }

}  // namespace

BoundaryMesh::BoundaryMesh(std::vector<Vec3d> points, std::vector<BoundaryFacet> facets,
                           double feature_angle, const std::function<void()>& check)
    : points_(std::move(points)), facets_(std::move(facets)) {
  Checkpoint checkpoint(check);
  find_edges(feature_angle, checkpoint);
  first_.assign(node_count() + 1, 0);
  for (const BoundaryEdge& edge : edges_) {
    for (const std::int32_t n : edge.nodes) ++first_[std::size_t(n) + 1];
  }
  for (std::size_t n = 0; n < node_count(); ++n) first_[n + 1] += first_[n];
  edge_ids_.resize(first_.back());
  sizes_.assign(node_count(), 0);
  std::vector<std::size_t> next = first_;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    checkpoint();
    for (const std::int32_t n : edges_[e].nodes) {
      edge_ids_[next[std::size_t(n)]++] = static_cast<std::int32_t>(e);
      sizes_[std::size_t(n)] += edges_[e].length;
    }
  }
  for (std::size_t n = 0; n < node_count(); ++n) {
    sizes_[n] /= std::max(1.0, static_cast<double>(first_[n + 1] - first_[n]));
  }
}

void BoundaryMesh::find_edges(double feature_angle, Checkpoint& checkpoint) {
  struct Use {
    std::int32_t low, high, facet;
    std::uint8_t side;  // of the facet
    bool forward;
  };
  std::vector<Use> uses;
  std::vector<Vec3d> normals(facets_.size());
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    checkpoint();
    normals[f] = normal(facets_[f]);
    const std::size_t count = corner_count(facets_[f]);
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t a = facets_[f][k], b = facets_[f][(k + 1) % count];
      uses.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(f),
                      static_cast<std::uint8_t>(k), a < b});
    }
  }
  const auto key = [](const Use& use) { return std::tuple(use.low, use.high, use.facet); };
  std::ranges::sort(uses, [&](const Use& a, const Use& b) {
    checkpoint();
    return key(a) < key(b);
  });
  edges_of_.assign(facets_.size(), {-1, -1, -1, -1});
  const double straight = std::cos(feature_angle * std::numbers::pi / 180);
  for (std::size_t n = 0, last = 0; n < uses.size(); n = last) {
    while (last < uses.size() && uses[last].low == uses[n].low && uses[last].high == uses[n].high) {
      edges_of_[std::size_t(uses[last].facet)][uses[last].side] =
          static_cast<std::int32_t>(edges_.size());
      ++last;
    }
    checkpoint();
    BoundaryEdge edge{{uses[n].low, uses[n].high}, {uses[n].facet, -1}, 0, true};
    edge.length = norm(points_[std::size_t(edge.nodes[1])] - points_[std::size_t(edge.nodes[0])]);
    if (last == n + 2) {
      edge.facets[1] = uses[n + 1].facet;
      const Vec3d a = normals[std::size_t(edge.facets[0])];
      const Vec3d b = normals[std::size_t(edge.facets[1])];
      const double side = uses[n].forward == uses[n + 1].forward ? -1 : 1;
      edge.crease = !(side * dot(a, b) >= straight * norm(a) * norm(b));
    }
    edges_.push_back(edge);
  }
}

int BoundaryMesh::crease_count(std::int32_t node) const {
  int count = 0;
  for (const std::int32_t e : edges_at(node)) count += edges_[std::size_t(e)].crease ? 1 : 0;
  return count;
}

Vec3d BoundaryMesh::centre(const BoundaryFacet& facet) const {
  Vec3d sum{0, 0, 0};
  const std::size_t count = corner_count(facet);
  for (std::size_t k = 0; k < count; ++k) sum += points_[std::size_t(facet[k])];
  return (1.0 / static_cast<double>(count)) * sum;
}

Vec3d BoundaryMesh::normal(const BoundaryFacet& facet) const {
  const auto at = [&](std::size_t k) { return points_[std::size_t(facet[k])]; };
  if (facet[3] < 0) return cross(at(1) - at(0), at(2) - at(0));
  return cross(at(2) - at(0), at(3) - at(1));
}

}  // namespace meshsmooth::detail

#pragma once

// Meshes that are written in ways of their own: see meshsmooth/canonical_topology.hpp.

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "core/smoothing.hpp"
#include "mesh/canonical/collapsed_element.hpp"
#include "meshsmooth/numbering.hpp"
#include "support/second_order.hpp"

namespace meshsmooth::test {

inline std::vector<ElementType> all_types() { return {kElementTypes.begin(), kElementTypes.end()}; }

inline Mesh lattice_of(ElementType type, int n) {
  const Mesh linear = noisy(lattice(linear_type(type), n), 0.15, 3);
  if (!is_second_order(type)) return linear;
  for (const bool full : {false, true}) {
    Mesh mesh = second_order(linear, full);
    if (mesh.blocks[0].type == type) return mesh;
  }
  return second_order(linear);
}

/// Which elements to mirror: speckles, a part, layers, a single one, all, a patch around a node.
inline std::vector<std::uint8_t> some_elements(const Mesh& mesh, std::mt19937_64& random) {
  const std::size_t count = mesh.element_count();
  std::vector<std::uint8_t> chosen(count);
  const int kind = std::uniform_int_distribution<int>(0, 5)(random);
  const double share = std::uniform_real_distribution<double>(0, 1)(random);
  for (std::size_t e = 0; e < count; ++e) {
    const double place = static_cast<double>(e) / static_cast<double>(count);
    const double dice = std::uniform_real_distribution<double>(0, 1)(random);
    const bool is_chosen = kind == 0   ? dice < share
                           : kind == 1 ? place < share
                           : kind == 2 ? e / 7 % 3 == 0
                           : kind == 3 ? e == count / 2
                                       : kind == 4;
    chosen[e] = is_chosen ? 1 : 0;
  }
  if (kind < 5) return chosen;
  const std::vector<Vec3d>& at = std::get<std::vector<Vec3d>>(mesh.positions);
  const Vec3d centre = at[random() % at.size()];
  const double radius = (0.2 + 0.6 * share) * norm(at.front() - at.back());
  std::size_t e = 0;
  for (const ElementBlock& block : mesh.blocks) {
    for (std::size_t n = 0; n < block.nodes.size(); n += element_width(block.type), ++e) {
      const Vec3d corner = at[static_cast<std::size_t>(block.nodes[n])];
      chosen[e] = norm(corner - centre) < radius ? 1 : 0;
    }
  }
  return chosen;
}

/// A lattice whose inner nodes are thrown so far that more than 30 % of the elements are inverted.
inline Mesh badly_tangled(ElementType type, int n) { return noisy(lattice(type, n), 1.2, 3); }

inline std::vector<NodeId> nodes_of(const detail::PlainElement& element) {
  return {element.list().begin(), element.list().end()};
}

/// A cube of hexahedra in which each of the first layer is split along a diagonal into two wedges,
/// written as hexahedra that repeat an edge if `collapsed`.
inline Mesh split_cube(bool collapsed) {
  const Mesh cube = noisy(lattice(ElementType::hexahedron, 4), 0.1, 5);
  Mesh mesh{cube.positions, {}, cube.fixed};
  const auto add = [&](ElementType type, std::vector<NodeId> nodes) {
    if (mesh.blocks.empty() || mesh.blocks.back().type != type) mesh.blocks.push_back({type, {}});
    auto& all = mesh.blocks.back().nodes;
    all.insert(all.end(), nodes.begin(), nodes.end());
  };
  const auto& from = cube.blocks[0].nodes;
  for (std::size_t e = 0; e < from.size() / 8; ++e) {
    const NodeId* n = &from[8 * e];
    if (e >= 16) {
      add(ElementType::hexahedron, {n, n + 8});
    } else if (collapsed) {
      add(ElementType::hexahedron, {n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]});
      add(ElementType::hexahedron, {n[0], n[2], n[3], n[3], n[4], n[6], n[7], n[7]});
    } else {
      add(ElementType::wedge,
          nodes_of(*detail::expand(
              ElementType::hexahedron,
              std::vector<NodeId>{n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]})));
      add(ElementType::wedge,
          nodes_of(*detail::expand(
              ElementType::hexahedron,
              std::vector<NodeId>{n[0], n[2], n[3], n[3], n[4], n[6], n[7], n[7]})));
    }
  }
  return mesh;
}

/// A lattice cut in the middle: the nodes there are doubled, and elements without thickness of
/// `type` lie between.
struct Cut {
  Mesh mesh;
  std::vector<std::pair<NodeId, NodeId>> pairs;
  std::int64_t interface_count = 0;
};

inline Cut cut_lattice(ElementType volume, bool second_order) {
  Cut cut{noisy(lattice(volume, 4), 0.12, 7), {}, 0};
  Mesh& mesh = cut.mesh;
  auto& points = test::points(mesh);
  const int axis = element_shape(volume).dimension - 1;
  const auto along = [axis](Vec3d p) { return axis == 1 ? p.y : p.z; };
  const Mesh even = lattice(volume, 4);
  const std::vector<Vec3d> grid = std::get<std::vector<Vec3d>>(even.positions);
  double low = along(grid[0]), high = low;
  for (const Vec3d p : grid) low = std::min(low, along(p)), high = std::max(high, along(p));
  const double middle = (low + high) / 2;
  std::map<NodeId, NodeId> other;
  for (std::size_t n = 0; n < grid.size(); ++n) {
    if (std::abs(along(grid[n]) - middle) > 1e-9) continue;
    other[static_cast<NodeId>(n)] = static_cast<NodeId>(points.size());
    cut.pairs.emplace_back(static_cast<NodeId>(n), static_cast<NodeId>(points.size()));
    points.push_back(Vec3d(points[n]));
  }
  if (!mesh.fixed.empty()) mesh.fixed.resize(points.size());
  const ElementShape& shape = element_shape(volume);
  const auto width = static_cast<std::size_t>(shape.node_count);
  ElementBlock interfaces;
  auto& nodes = mesh.blocks[0].nodes;
  for (std::size_t e = 0; e < nodes.size() / width; ++e) {
    NodeId* const own = &nodes[e * width];
    double centre = 0;
    for (std::size_t n = 0; n < width; ++n) centre += along(grid[static_cast<std::size_t>(own[n])]);
    if (centre / static_cast<double>(width) < middle) continue;
    for (int f = 0; f < shape.facet_count; ++f) {
      const FacetShape& facet = shape.facets[f];
      std::vector<NodeId> face;
      for (int n = 0; n < facet.node_count; ++n) face.push_back(own[facet.nodes[n]]);
      if (!std::ranges::all_of(face, [&](NodeId n) { return other.contains(n); })) continue;
      ++cut.interface_count;
      interfaces.type = axis == 1          ? ElementType::quad
                        : face.size() == 4 ? ElementType::hexahedron
                                           : ElementType::wedge;
      if (axis == 1) {
        for (const NodeId n : {face[0], face[1], other[face[1]], other[face[0]]})
          interfaces.nodes.push_back(n);
      } else {
        for (const NodeId n : face) interfaces.nodes.push_back(n);
        for (const NodeId n : face) interfaces.nodes.push_back(other[n]);
      }
    }
    for (std::size_t n = 0; n < width; ++n) {
      if (other.contains(own[n])) own[n] = other[own[n]];
    }
  }
  mesh.blocks.insert(mesh.blocks.begin(), std::move(interfaces));
  if (second_order) mesh = test::second_order(mesh);
  return cut;
}

}  // namespace meshsmooth::test

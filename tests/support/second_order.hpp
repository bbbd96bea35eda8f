#pragma once

// Meshes of second order, made from linear ones.

#include <algorithm>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "support/meshes.hpp"

namespace meshsmooth::test {

inline constexpr std::array kSecondOrderTypes = {
    ElementType::triangle6,     ElementType::quad8,        ElementType::quad9,
    ElementType::tetrahedron10, ElementType::pyramid13,    ElementType::wedge15,
    ElementType::wedge18,       ElementType::hexahedron20, ElementType::hexahedron27};

/// The type of second order of a linear type: that with the most nodes, or with the fewest.
inline ElementType second_order_type(ElementType linear, bool full) {
  ElementType found = linear;
  for (const ElementType type : kSecondOrderTypes) {
    if (linear_type(type) == linear && (full || found == linear)) found = type;
  }
  return found;
}

/// The linear mesh with a node in the middle of each edge, and with `full` of each quadrilateral
/// and of the elements whose type has one there. The nodes that it had keep their numbers.
inline Mesh second_order(const Mesh& linear, bool full = false) {
  Mesh mesh = linear;
  std::map<std::vector<NodeId>, NodeId> known;
  std::vector<Vec3d>& positions = points(mesh);
  for (ElementBlock& block : mesh.blocks) {
    const std::size_t width = element_width(block.type);
    const ElementType type = second_order_type(block.type, full);
    std::vector<NodeId> nodes;
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      const std::span corners = std::span(block.nodes).subspan(at, width);
      nodes.insert(nodes.end(), corners.begin(), corners.end());
      for (const MidNode& mid : mid_nodes(type)) {
        std::vector<NodeId> of;
        Vec3d sum{0, 0, 0};
        for (int c = 0; c < mid.corner_count; ++c) {
          of.push_back(corners[static_cast<std::size_t>(mid.corners[static_cast<std::size_t>(c)])]);
        }
        std::ranges::sort(of);
        for (const NodeId node : of) sum += positions[static_cast<std::size_t>(node)];
        const auto [found, added] = known.try_emplace(of, static_cast<NodeId>(positions.size()));
        if (added) positions.push_back((1.0 / static_cast<double>(of.size())) * sum);
        nodes.push_back(found->second);
      }
    }
    block = {type, std::move(nodes)};
  }
  if (!mesh.fixed.empty()) mesh.fixed.resize(positions.size());
  return mesh;
}

}  // namespace meshsmooth::test

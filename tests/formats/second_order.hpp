#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "mesh_file.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::formats::test {

/// The corners of an element and the mean of each part that has a node in its middle.
inline std::vector<Vec3d> with_middles(ElementType type, std::vector<Vec3d> corners) {
  std::vector<Vec3d> nodes = corners;
  for (const MidNode& mid : mid_nodes(type)) {
    Vec3d sum{0, 0, 0};
    for (int corner = 0; corner < mid.corner_count; ++corner) {
      sum += corners[static_cast<std::size_t>(mid.corners[static_cast<std::size_t>(corner)])];
    }
    nodes.push_back((1.0 / mid.corner_count) * sum);
  }
  return nodes;
}

/// One element, crooked, so that no two sets of corners have the same mean.
inline Mesh crooked_element(ElementType type) {
  std::vector<Vec3d> corners = meshsmooth::test::ideal_points(linear_type(type));
  double shift = 0.01;
  for (Vec3d& corner : corners) {
    corner += {shift, -2 * shift, element_shape(type).dimension == 3 ? 0.7 * shift : 0};
    shift *= -1.3;
  }
  std::vector<Vec3d> nodes = with_middles(type, std::move(corners));
  std::vector<NodeId> ids(nodes.size());
  for (std::size_t node = 0; node < ids.size(); ++node) ids[node] = static_cast<NodeId>(node);
  return meshsmooth::test::make_mesh(std::move(nodes), {{type, std::move(ids)}});
}

/// The type of second order over a linear one: with as few nodes as there are, or with as many.
inline ElementType raised(ElementType linear, bool full) {
  ElementType result = linear;
  for (const ElementType type : kElementTypes) {
    if (linear_type(type) == linear && is_second_order(type)) {
      result = type;
      if (!full) break;
    }
  }
  return result;
}

/// The mesh with nodes in the middle, which neighbours share.
inline Mesh second_order(const Mesh& linear, bool full) {
  Mesh mesh;
  std::vector<Vec3d> nodes = meshsmooth::test::points(linear);
  std::map<std::vector<NodeId>, NodeId> known;
  for (const ElementBlock& block : linear.blocks) {
    const ElementType type = raised(block.type, full);
    ElementBlock& to = mesh.blocks.emplace_back(ElementBlock{type, {}});
    const std::size_t width = element_width(block.type);
    for (std::size_t first = 0; first < block.nodes.size(); first += width) {
      const auto corners = std::span(block.nodes).subspan(first, width);
      std::vector<Vec3d> places;
      for (const NodeId node : corners) places.push_back(nodes[static_cast<std::size_t>(node)]);
      const std::vector<Vec3d> all = with_middles(type, std::move(places));
      to.nodes.insert(to.nodes.end(), corners.begin(), corners.end());
      std::size_t place = width;
      for (const MidNode& mid : mid_nodes(type)) {
        std::vector<NodeId> key;
        for (int corner = 0; corner < mid.corner_count; ++corner) {
          key.push_back(corners[static_cast<std::size_t>(mid.corners[std::size_t(corner)])]);
        }
        std::ranges::sort(key);
        const auto [found, is_new] = known.emplace(key, static_cast<NodeId>(nodes.size()));
        if (is_new) nodes.push_back(all[place]);
        to.nodes.push_back(found->second);
        ++place;
      }
    }
  }
  mesh.positions = std::move(nodes);
  return mesh;
}

/// By kind the number of cells in a file, of any dimension, after a check that each node in the
/// middle of corners is their mean, up to `tolerance`, and that no volume is inverted.
inline std::map<std::string, int> check_cells(const MeshFile& file, double tolerance = 1e-12) {
  std::map<std::string, int> counts;
  const Dataset& dataset = *file.content()->dataset;
  std::vector<Vec3d> positions;
  std::visit(
      [&](const auto& nodes) {
        for (const auto& node : nodes) positions.push_back(vec3_cast<double>(node));
      },
      dataset.positions());
  constexpr MidNode kMiddle = {2, {0, 1}};
  Cell cell;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    const CellKind* const kind = find_vtk_cell(cell.type, cell.nodes.size());
    if (kind == nullptr) {
      ADD_FAILURE() << "cell " << id << " is of the type " << cell.type;
      continue;
    }
    ++counts[std::string(kind->name)];
    if (!is_second_order(*kind)) continue;
    std::vector<Vec3d> nodes;
    for (const std::int64_t node : cell.nodes) nodes.push_back(positions.at(std::size_t(node)));
    const auto mids = kind->element ? mid_nodes(*kind->element) : std::span(&kMiddle, 1);
    std::size_t node = kind->element ? element_width(linear_type(*kind->element)) : 2;
    for (const MidNode& mid : mids) {
      Vec3d sum{0, 0, 0};
      for (int corner = 0; corner < mid.corner_count; ++corner) {
        sum += nodes[static_cast<std::size_t>(mid.corners[static_cast<std::size_t>(corner)])];
      }
      const Vec3d away = nodes[node] - (1.0 / mid.corner_count) * sum;
      EXPECT_LE(std::sqrt(dot(away, away)), tolerance)
          << kind->name << ", cell " << id << ", node " << node;
      ++node;
    }
    if (kind->dimension < 3) continue;
    for (const CornerShape& corner :
         std::span(element_shape(*kind->element).corners)
             .first(static_cast<std::size_t>(element_shape(*kind->element).corner_count))) {
      const auto edge = [&](std::size_t n) {
        return nodes[static_cast<std::size_t>(corner.neighbours[n])] -
               nodes[static_cast<std::size_t>(corner.node)];
      };
      EXPECT_GT(dot(cross(edge(0), edge(1)), edge(2)), 0) << kind->name << ", cell " << id;
    }
  }
  return counts;
}

}  // namespace meshsmooth::formats::test

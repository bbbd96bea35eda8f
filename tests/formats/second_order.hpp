#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "mesh_file.hpp"
#include "support/second_order.hpp"

namespace meshsmooth::formats::test {

/// One element, crooked, so that no two sets of corners have the same mean.
inline Mesh crooked_element(ElementType type) {
  std::vector<Vec3d> corners = meshsmooth::test::ideal_points(linear_type(type));
  double shift = 0.01;
  for (Vec3d& corner : corners) {
    corner += {shift, -2 * shift, element_shape(type).dimension == 3 ? 0.7 * shift : 0};
    shift *= -1.3;
  }
  std::vector<NodeId> ids(element_width(type));
  std::iota(ids.begin(), ids.end(), 0);
  for (const MidNode& mid : mid_nodes(type)) {
    Vec3d sum{0, 0, 0};
    for (int corner = 0; corner < mid.corner_count; ++corner) {
      sum += corners[static_cast<std::size_t>(mid.corners[static_cast<std::size_t>(corner)])];
    }
    corners.push_back((1.0 / mid.corner_count) * sum);
  }
  return meshsmooth::test::make_mesh(std::move(corners), {{type, std::move(ids)}});
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

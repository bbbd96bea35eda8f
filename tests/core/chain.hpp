#pragma once

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "smooth/base/colouring_rule.hpp"

namespace meshsmooth::test {

/// A strip of n nodes whose ids make each wait for the one before it to choose its colour.
inline Mesh chain(int n) {
  std::vector<NodeId> ids(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) ids[static_cast<std::size_t>(i)] = i;
  std::ranges::sort(ids, std::ranges::greater(), detail::colour_priority);
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>(static_cast<std::size_t>(n));
  std::vector<NodeId> triangles;
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    positions[static_cast<std::size_t>(ids[at])] = {i * 1.0, i % 2 * 0.87, 0};
    if (i + 2 >= n) continue;
    const bool up = i % 2 == 0;
    triangles.insert(triangles.end(), {ids[at], ids[at + (up ? 2 : 1)], ids[at + (up ? 1 : 2)]});
    std::swap(triangles.end()[-1], triangles.end()[-2]);
  }
  mesh.blocks = {{ElementType::triangle, std::move(triangles)}};
  return mesh;
}

}  // namespace meshsmooth::test

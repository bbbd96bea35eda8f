#pragma once

// For tests of how the cost of a job grows.

#include <cmath>
#include <ctime>
#include <numbers>
#include <utility>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::test {

inline constexpr double kTurn = 2 * std::numbers::pi;

/// n tetrahedra about an axis; its first end is a hub on the boundary.
inline Mesh cone(int n) {
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>();
  positions = {{0, 0, 0}, {0, 0, 1}};
  std::vector<NodeId> tetrahedra;
  for (int i = 0; i < n; ++i) {
    positions.push_back({std::cos(kTurn * i / n), std::sin(kTurn * i / n), 1});
    tetrahedra.insert(tetrahedra.end(), {0, 1, 2 + (i + 1) % n, 2 + i});
  }
  mesh.blocks = {{ElementType::tetrahedron, std::move(tetrahedra)}};
  return mesh;
}

/// Of this process.
inline double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace meshsmooth::test

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <variant>
#include <vector>

#include "meshsmooth/client.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::testing {

/// Two tetrahedra and nodes without elements, about so many bytes on the wire.
inline Mesh mesh_of_bytes(std::size_t bytes) {
  Mesh mesh = test::two_tets();
  auto& positions = std::get<std::vector<Vec3d>>(mesh.positions);
  positions.resize(std::max(positions.size(), bytes / sizeof(Vec3d)), Vec3d{1, 2, 3});
  return mesh;
}

/// By the fake smoother, which moves every node by one.
inline void expect_smoothed(client::Client& client, Mesh mesh,
                            const client::RequestOptions& request = {}) {
  const auto before = std::get<std::vector<Vec3d>>(mesh.positions);
  client.smooth(mesh, {}, request);
  const auto& after = std::get<std::vector<Vec3d>>(mesh.positions);
  ASSERT_EQ(after.size(), before.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < after.size(); ++i) wrong += after[i].x != before[i].x + 1;
  EXPECT_EQ(wrong, 0U);
}

}  // namespace meshsmooth::testing

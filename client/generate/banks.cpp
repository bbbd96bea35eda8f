#include "generate/generate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "generate/check_node_count.hpp"
#include "generate/delaunay.hpp"
#include "generate/random.hpp"
#include "generate/tangle.hpp"

namespace meshsmooth::formats {
namespace {

using Counts = std::array<std::size_t, 3>;

/// A box whose front face leans back: at height z the solid begins at
/// x = lean * z / height. No lean is an upright box.
struct Bank {
  Vec3d size;
  double lean;

  [[nodiscard]] Vec3d place(Vec3d unit) const {
    const double front = lean * unit.z;
    return {front + (size.x - front) * unit.x, size.y * unit.y, size.z * unit.z};
  }
  /// Distance of a point to the nearest face; negative outside.
  [[nodiscard]] double depth(Vec3d point) const {
    const double slope = (point.x * size.z - lean * point.z) / std::hypot(size.z, lean);
    return std::min(
        {slope, size.x - point.x, point.y, size.y - point.y, point.z, size.z - point.z});
  }
};

/// Nodes, first those on the surface; `faces[n]` has a bit for each of the six
/// faces that node n lies on.
struct Cloud {
  std::vector<Vec3d> nodes;
  std::vector<std::uint8_t> faces;
};

std::size_t surface_count(const Counts& grid) {
  return grid[0] * grid[1] * grid[2] - (grid[0] - 2) * (grid[1] - 2) * (grid[2] - 2);
}

/// The nodes of a regular grid that lie on the surface.
Cloud surface_nodes(const Bank& bank, const Counts& grid) {
  Cloud cloud;
  const auto unit = [&](std::size_t index, int axis) {
    return static_cast<double>(index) /
           static_cast<double>(grid[static_cast<std::size_t>(axis)] - 1);
  };
  for (std::size_t i = 0; i < grid[0]; ++i) {
    for (std::size_t j = 0; j < grid[1]; ++j) {
      for (std::size_t k = 0; k < grid[2]; ++k) {
        const int faces = (i == 0) | (i == grid[0] - 1) << 1 | (j == 0) << 2 |
                          (j == grid[1] - 1) << 3 | (k == 0) << 4 | (k == grid[2] - 1) << 5;
        if (faces == 0) continue;
        cloud.nodes.push_back(bank.place({unit(i, 0), unit(j, 1), unit(k, 2)}));
        cloud.faces.push_back(static_cast<std::uint8_t>(faces));
      }
    }
  }
  return cloud;
}

/// Uniformly random inside, a little off the walls: a node closer to a wall
/// than to its grid makes nothing but slivers.
void add_interior_nodes(Cloud& cloud, const Bank& bank, std::size_t node_count, double spacing,
                        std::uint64_t seed) {
  Random random(seed);
  while (cloud.nodes.size() < node_count) {
    const double x = random.between(0, bank.size.x);
    const double y = random.between(0, bank.size.y);
    const Vec3d node = {x, y, random.between(0, bank.size.z)};
    if (bank.depth(node) < 0.25 * spacing) continue;
    cloud.nodes.push_back(node);
    cloud.faces.push_back(0);
  }
}

/// Tetrahedra of a convex cloud, without the flat ones that a triangulation
/// leaves where four nodes lie on one face of the hull.
std::vector<NodeId> fill(const Cloud& cloud) {
  const std::vector<NodeId> all = delaunay_tetrahedra(cloud.nodes);
  std::vector<NodeId> kept;
  kept.reserve(all.size());
  for (std::size_t first = 0; first < all.size(); first += 4) {
    std::uint8_t common = 0xff;
    for (std::size_t corner = first; corner < first + 4; ++corner) {
      common &= cloud.faces[static_cast<std::size_t>(all[corner])];
    }
    if (common == 0)
      kept.insert(kept.end(), all.begin() + static_cast<std::ptrdiff_t>(first),
                  all.begin() + static_cast<std::ptrdiff_t>(first + 4));
  }
  return kept;
}

Mesh generate_bank(const Bank& bank, std::size_t node_count, std::uint64_t seed, double share) {
  const double volume = bank.size.y * bank.size.z * (bank.size.x - 0.5 * bank.lean);
  const double spacing = std::cbrt(volume / static_cast<double>(node_count));
  const auto count = [&](double length) {
    return std::max<std::size_t>(2, static_cast<std::size_t>(std::lround(length / spacing)));
  };
  Counts grid = {count(bank.size.x - 0.5 * bank.lean), count(bank.size.y), count(bank.size.z)};
  // Few nodes lie mostly on the surface; leave some for the inside.
  while (surface_count(grid) >= node_count) {
    auto& most = *std::max_element(grid.begin(), grid.end());
    if (most <= 3) break;
    --most;
  }
  Cloud cloud = surface_nodes(bank, grid);
  add_interior_nodes(cloud, bank, node_count, spacing, seed);

  Mesh mesh;
  mesh.blocks.push_back({ElementType::tetrahedron, fill(cloud)});
  std::vector<std::uint8_t> inside(cloud.faces.size());
  std::transform(cloud.faces.begin(), cloud.faces.end(), inside.begin(),
                 [](std::uint8_t faces) { return static_cast<std::uint8_t>(faces == 0); });
  mesh.positions = std::move(cloud.nodes);
  tangle(mesh, inside, share, seed);
  return mesh;
}

}  // namespace

Mesh generate_cube(std::size_t node_count, std::uint64_t seed, double tangle) {
  check_node_count(node_count, 27);
  check_tangle(tangle);
  return generate_bank({{1, 1, 1}, 0}, node_count, seed, tangle);
}

Mesh generate_slope(std::size_t node_count, std::uint64_t seed, double tangle) {
  check_node_count(node_count, 100);
  check_tangle(tangle);
  return generate_bank({{4, 2, 1}, 1.5}, node_count, seed, tangle);
}

}  // namespace meshsmooth::formats

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "generate/check_node_count.hpp"
#include "generate/delaunay.hpp"
#include "generate/generate.hpp"
#include "generate/random.hpp"
#include "generate/tangle.hpp"

namespace meshsmooth::formats {
namespace {

constexpr double kPi = std::numbers::pi;

/// Along a spiral that spaces them evenly, perturbed along the unit sphere.
std::vector<Vec3d> sphere_nodes(std::size_t count, double jitter, Random& random) {
  std::vector<Vec3d> nodes;
  const double turn = kPi * (3 - std::sqrt(5.0));
  for (std::size_t n = 0; n < count; ++n) {
    const double z = 1 - (2 * static_cast<double>(n) + 1) / static_cast<double>(count);
    const double radius = std::sqrt(1 - z * z);
    const double angle = turn * static_cast<double>(n);
    const Vec3d thrown =
        Vec3d{radius * std::cos(angle), radius * std::sin(angle), z} + random.vector(jitter);
    nodes.push_back((1 / norm(thrown)) * thrown);
  }
  return nodes;
}

/// A grid of cells around, through the wall and along; it closes in the first direction.
struct PipeGrid {
  int around, through, along;

  [[nodiscard]] NodeId node(int i, int j, int k) const {
    return (k * (through + 1) + j) * around + i % around;
  }
};

}  // namespace

Mesh generate_ball(std::size_t node_count, std::uint64_t seed, double share) {
  check_node_count(node_count, 100);
  check_tangle(share);
  Random random(seed);
  const double spacing = std::cbrt(4 * kPi / 3 / static_cast<double>(node_count));
  const auto wanted = static_cast<std::size_t>(std::lround(4 * kPi / (spacing * spacing)));
  std::vector<Vec3d> nodes =
      sphere_nodes(std::min(wanted, node_count / 4 * 3), 0.25 * spacing, random);
  const std::size_t surface_count = nodes.size();
  while (nodes.size() < node_count) {
    const Vec3d node = random.vector(1);
    if (norm(node) < 1 - 0.25 * spacing) nodes.push_back(node);
  }
  Mesh mesh;
  mesh.blocks.push_back({ElementType::tetrahedron, delaunay_tetrahedra(nodes)});
  std::vector<std::uint8_t> inside(node_count, 1);
  std::fill_n(inside.begin(), surface_count, std::uint8_t{0});
  mesh.positions = std::move(nodes);
  tangle(mesh, inside, share, seed);
  return mesh;
}

Mesh generate_pipe(std::size_t node_count, std::uint64_t seed, double share) {
  check_node_count(node_count, 216);
  check_tangle(share);
  constexpr double kJitter = 0.15;  // of the spacing; keeps all elements valid
  constexpr double kInner = 0.5;    // of the outer radius, as is the wall; the pipe is 1 long
  const double volume = kPi * (1 - kInner * kInner);
  const double spacing = std::cbrt(volume / static_cast<double>(node_count));
  const auto cells = [&](double length, int least) {
    return std::max(least, static_cast<int>(std::lround(length / spacing)));
  };
  const PipeGrid grid{cells(kPi * (1 + kInner), 24), cells(1 - kInner, 2), cells(1, 2)};
  Random random(seed);
  std::vector<Vec3d> nodes;
  std::vector<std::uint8_t> inside;
  for (int k = 0; k <= grid.along; ++k) {
    for (int j = 0; j <= grid.through; ++j) {
      for (int i = 0; i < grid.around; ++i) {
        const Vec3d thrown = random.vector(kJitter);
        const bool in_wall = j > 0 && j < grid.through;
        const bool in_length = k > 0 && k < grid.along;
        const double angle = 2 * kPi * (i + thrown.x) / grid.around;
        const double radius =
            kInner + (1 - kInner) * (j + (in_wall ? thrown.y : 0.0)) / grid.through;
        const double z = (k + (in_length ? thrown.z : 0.0)) / grid.along;
        nodes.push_back({radius * std::sin(angle), radius * std::cos(angle), z});
        inside.push_back(in_wall && in_length ? 1 : 0);
      }
    }
  }
  std::vector<NodeId> tetrahedra;
  for (int k = 0; k < grid.along; ++k) {
    for (int j = 0; j < grid.through; ++j) {
      for (int i = 0; i < grid.around; ++i) {
        const auto at = [&](int x, int y, int z) { return grid.node(i + x, j + y, k + z); };
        const NodeId low = at(0, 0, 0), high = at(1, 1, 1);
        // Six around the diagonal of the cell.
        const std::array<NodeId, 7> ring = {at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 1, 1),
                                            at(0, 0, 1), at(1, 0, 1), at(1, 0, 0)};
        for (std::size_t n = 0; n < 6; ++n) {
          tetrahedra.insert(tetrahedra.end(), {low, ring[n], ring[n + 1], high});
        }
      }
    }
  }
  Mesh mesh;
  mesh.positions = std::move(nodes);
  mesh.blocks.push_back({ElementType::tetrahedron, std::move(tetrahedra)});
  tangle(mesh, inside, share, seed);
  return mesh;
}

}  // namespace meshsmooth::formats

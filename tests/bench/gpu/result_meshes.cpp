#include "gpu/result_meshes.hpp"

#include <cmath>
#include <cstdint>
#include <utility>

#include "generate/generate.hpp"
#include "generate/random.hpp"

namespace meshsmooth::bench {
namespace {

constexpr std::uint64_t kSeed = 1;

std::vector<Vec3d>& positions_of(Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}

/// The cube [-1, 1]^3 with its faces bulged halfway towards the unit sphere; planes through
/// the centre stay plane.
Vec3d bulged(Vec3d p) {
  const Vec3d s = {p.x * p.x, p.y * p.y, p.z * p.z};
  const auto along = [](double c, double a, double b) {
    return c * (0.5 + 0.5 * std::sqrt(1 - a / 2 - b / 2 + a * b / 3));
  };
  return {along(p.x, s.y, s.z), along(p.y, s.z, s.x), along(p.z, s.x, s.y)};
}

Vec3d centre_of(const std::vector<Vec3d>& positions, const NodeId* nodes, int count) {
  Vec3d sum{0, 0, 0};
  for (int n = 0; n < count; ++n) sum += positions[static_cast<std::size_t>(nodes[n])];
  return (1.0 / count) * sum;
}

/// Two regions on either side of the plane x = 0.
Mesh make_mixed() {
  constexpr double kCellsAlong = 12;
  Mesh mesh = formats::generate_mixed(3000, kSeed);
  std::vector<Vec3d>& positions = positions_of(mesh);
  for (Vec3d& p : positions) {
    // The jitter moved the plane's own nodes off it by less than this.
    if (std::abs(p.x - 0.5) < 0.2 / kCellsAlong) p.x = 0.5;
    p = bulged({2 * p.x - 1, 2 * p.y - 1, 2 * p.z - 1});
  }
  for (const ElementBlock& block : mesh.blocks) {
    const int width = element_shape(block.type).node_count;
    for (std::size_t at = 0; at < block.nodes.size(); at += static_cast<std::size_t>(width)) {
      mesh.regions.push_back(centre_of(positions, &block.nodes[at], width).x < 0 ? 1 : 2);
    }
  }
  return mesh;
}

Mesh make_hexahedra() {
  constexpr int kCells = 12;
  constexpr double kJitter = 0.2;
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>{};
  std::vector<Vec3d>& positions = positions_of(mesh);
  mesh.blocks = {{ElementType::hexahedron, {}}};
  formats::Random random(kSeed);
  const auto inner = [](int index) { return index > 0 && index < kCells; };
  for (int k = 0; k <= kCells; ++k) {
    for (int j = 0; j <= kCells; ++j) {
      for (int i = 0; i <= kCells; ++i) {
        const Vec3d jitter = random.vector(kJitter);
        const Vec3d place = {double(i), double(j), double(k)};
        positions.push_back(inner(i) && inner(j) && inner(k) ? place + jitter : place);
        mesh.fixed.push_back(positions.size() % 37 == 0 ? 1 : 0);
        if (i == kCells || j == kCells || k == kCells) continue;
        const auto at = [&](int x, int y, int z) {
          return static_cast<NodeId>(((k + z) * (kCells + 1) + j + y) * (kCells + 1) + i + x);
        };
        for (const NodeId node : {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1),
                                  at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)}) {
          mesh.blocks[0].nodes.push_back(node);
        }
      }
    }
  }
  positions.push_back({0.125, 0.25, 0.5});
  mesh.fixed.push_back(0);
  return mesh;
}

Mesh make_surface() {
  constexpr double kNoise = 0.002;
  Mesh mesh = formats::generate_square(3600, kSeed);
  formats::Random random(kSeed);
  for (Vec3d& p : positions_of(mesh)) {
    const bool inner = p.x > 0 && p.x < 1 && p.y > 0 && p.y < 1;
    p.z = 0.6 * p.x * (1 - p.x) - 0.4 * p.y * p.y;
    if (inner) p.z += random.between(-kNoise, kNoise);
  }
  return mesh;
}

}  // namespace

std::vector<ResultMesh> make_result_meshes() {
  std::vector<ResultMesh> meshes;
  meshes.push_back({"cube", formats::generate_cube(5000, kSeed)});
  meshes.push_back({"tangled", formats::generate_ball(2500, kSeed, 0.1)});
  meshes.push_back({"mixed", make_mixed()});
  meshes.push_back({"grid", make_hexahedra()});
  meshes.push_back({"surface", make_surface()});
  return meshes;
}

}  // namespace meshsmooth::bench

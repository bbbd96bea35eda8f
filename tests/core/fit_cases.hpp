#pragma once

// Meshes with a target surface, for both backends.

#include <random>
#include <utility>

#include "meshsmooth/options.hpp"
#include "support/cells.hpp"
#include "support/fit_surfaces.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::test {

inline JobInput on(const SurfaceMesh& surface) {
  JobInput input;
  input.surface = &surface;
  return input;
}
inline SmoothOptions sliding() { return {.method = Optimize{}, .boundary = BoundaryPolicy::slide}; }

/// Elements of the cube from `lower` to `upper`, along each axis.
inline Mesh box_mesh(ElementType type, int n, double lower, double upper) {
  Mesh mesh = lattice(type, n);
  for (Vec3d& p : points(mesh)) {
    const auto to = [=](double x) { return lower + (upper - lower) * x / n; };
    p = {to(p.x), to(p.y), to(p.z)};
  }
  return mesh;
}

/// Hexahedra of an L whose surface is `l_surface`, off it.
inline Mesh l_mesh(int n) {
  const Cells cells(ElementType::hexahedron, 2 * n,
                    [=](int x, int, int z) { return x >= n && z >= n ? Cells::kNone : 0; });
  Mesh mesh = cells.mesh();
  mesh.regions.clear();
  for (Vec3d& p : points(mesh)) p = (0.5 / n) * p + Vec3d{0.02, -0.03, 0.01};
  return mesh;
}

/// Hexahedra of the unit cube, thrown about on its sides and inside.
inline Mesh thrown_box_mesh() {
  const Cells cells(ElementType::hexahedron, 4, [](int, int, int) { return 0; });
  Mesh mesh = cells.thrown(0.3, 3);
  mesh.regions.clear();
  for (Vec3d& p : points(mesh)) p = 0.25 * p;
  return mesh;
}

/// As a scan may be: every edge is a crease, and every triangle a patch.
inline SurfaceMesh folded_surface() {
  SurfaceMesh surface = box_surface(16, {1, 1, 1});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> at(-0.2, 0.2);
  for (Vec3d& p : surface.points) p = p + Vec3d{at(random), at(random), at(random)};
  return surface;
}

inline SurfaceMesh sphere_with_hole() {
  SurfaceMesh surface = sphere_surface(12, 1);
  std::erase_if(surface.triangles, [&](const auto& t) { return surface.points[t[0]].z > 0.8; });
  return surface;
}

/// Fixed nodes hold an element turned over, so that the mesh stays tangled.
inline Mesh tangled_box_mesh(ElementType type, unsigned seed) {
  Mesh mesh = noisy(box_mesh(type, 5, 0.03, 0.95), 0.1, seed);
  mesh.fixed.assign(mesh.node_count(), 0);
  const auto nodes = mesh.blocks[0].nodes;
  const std::size_t first = nodes.size() / 2 / 8 * 8;
  for (std::size_t k = 0; k < 8; ++k) mesh.fixed[std::size_t(nodes[first + k])] = 1;
  std::swap(points(mesh)[std::size_t(nodes[first])], points(mesh)[std::size_t(nodes[first + 2])]);
  return mesh;
}

}  // namespace meshsmooth::test

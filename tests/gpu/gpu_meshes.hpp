#pragma once

// What the tests of the CUDA backend run on.

#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/smoother.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::test {

using NamedMesh = std::pair<std::string, Mesh>;

/// Curved into most of a narrow ring: plain averaging pulls its nodes over the inner
/// wall, so the guard has work.
inline Mesh horseshoe(ElementType type, int n) {
  const bool surface = element_shape(type).dimension == 2;
  return mapped(noisy(lattice(type, n), 0.05, 3), [=](Vec3d p) {
    const double angle = p.x / n * 4, radius = 0.3 + p.y / n;
    return Vec3d{radius * std::sin(angle), radius * std::cos(angle), surface ? 0.0 : p.z / n};
  });
}

/// Fixed by the caller: every fourth node.
inline Mesh with_mask(Mesh mesh) {
  mesh.fixed.assign(mesh.node_count(), 0);
  for (std::size_t n = 0; n < mesh.node_count(); n += 4) mesh.fixed[n] = 255;
  return mesh;
}

/// Every element type, every oddity; few nodes.
inline std::vector<NamedMesh> tiny_meshes() {
  std::vector<NamedMesh> meshes = {
      {"two_tets", two_tets()},
      {"tet_ball", tet_ball()},
      {"triangle_ring", triangle_ring()},
      {"open_cone", open_cone()},
      {"sphere", noisy(sphere(2), 0.02, 4)},
      {"mixed_stack", noisy(mixed_stack(4), 0.1, 1)},
      {"disconnected_pieces", disconnected_pieces()},
      // Balls and rings beyond what the kernels are made for.
      {"spokes_128", noisy(spokes(2), 0.02, 4)},
      {"spokes_512", noisy(spokes(3), 0.02, 4)},
      {"spokes_2048", noisy(spokes(4), 0.005, 4)},
      {"isolated_node", with_isolated_node(noisy(lattice(ElementType::wedge, 3), 0.1, 5))},
      {"masked", with_mask(noisy(lattice(ElementType::hexahedron, 4), 0.1, 6))},
      {"tangled", noisy(lattice(ElementType::tetrahedron, 4), 0.45, 7)},
  };
  for (const ElementType type : kLinearTypes) {
    const std::string name(element_name(type));
    meshes.emplace_back("single_" + name, single(type));
    meshes.emplace_back("lattice_" + name, noisy(lattice(type, 4), 0.1, 3));
  }
  return meshes;
}

/// Several blocks of threads, sizes that are no multiple of 32.
inline std::vector<NamedMesh> small_meshes() {
  std::vector<NamedMesh> meshes = {
      {"sphere", noisy(sphere(5), 0.01, 4)},
      {"mixed_stack", noisy(mixed_stack(17), 0.15, 1)},
      {"masked", with_mask(noisy(lattice(ElementType::tetrahedron, 13), 0.15, 6))},
      {"tangled", noisy(lattice(ElementType::tetrahedron, 11), 0.45, 7)},
  };
  for (const ElementType type : kLinearTypes) {
    const std::string name(element_name(type));
    const int n = element_shape(type).dimension == 2 ? 61 : 13;
    meshes.emplace_back("lattice_" + name, noisy(lattice(type, n), 0.15, 3));
    meshes.emplace_back("horseshoe_" + name, horseshoe(type, n));
  }
  return meshes;
}

}  // namespace meshsmooth::test

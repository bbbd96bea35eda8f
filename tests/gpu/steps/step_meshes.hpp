#pragma once

// What the tests of the CUDA steps run on.

#include <string>
#include <utility>
#include <vector>

#include "core/steps.hpp"
#include "gpu/gpu_meshes.hpp"

namespace meshsmooth::test {

/// For the search of rings and boundary: every element type, and rows that leave the usual path.
inline std::vector<NamedMesh> topology_meshes() {
  std::vector<NamedMesh> meshes = step_meshes();
  meshes.emplace_back("scattered_blocks", scattered_blocks());
  meshes.emplace_back("cone_31", open_cone(31));  // rings around the 32 that a thread keeps
  meshes.emplace_back("cone_32", open_cone(32));
  meshes.emplace_back("cone_33", open_cone(33));
  meshes.emplace_back("spokes_128", spokes(2));   // more elements than a ball has slots
  meshes.emplace_back("spokes_512", spokes(3));   // more neighbours than a warp's table holds
  meshes.emplace_back("spokes_2048", spokes(4));  // more than a block's: searched in parts
  meshes.emplace_back("cone_3000", open_cone(3000));
  meshes.emplace_back("many_blocks", noisy(lattice(ElementType::tetrahedron, 21), 0.1, 2));
  meshes.emplace_back("many_hexahedra", noisy(lattice(ElementType::hexahedron, 21), 0.1, 2));
  return meshes;
}

/// For sweeps: valid meshes of every element type with free nodes, and a ring of more than 32.
inline std::vector<NamedMesh> sweep_meshes() {
  std::vector<NamedMesh> meshes = {
      {"tet_ball", with_isolated_node(tet_ball())},
      {"triangle_ring", triangle_ring()},
      {"spokes_128", noisy(spokes(2), 0.02, 4)},
      {"mixed_stack", noisy(mixed_stack(4), 0.12, 12)},
      {"masked", with_mask(noisy(lattice(ElementType::tetrahedron, 5), 0.12, 14))},
  };
  for (const ElementType type : kLinearTypes) {
    meshes.emplace_back("lattice_" + std::string(element_name(type)),
                        noisy(lattice(type, 5), 0.12, 11));
  }
  return meshes;
}

}  // namespace meshsmooth::test

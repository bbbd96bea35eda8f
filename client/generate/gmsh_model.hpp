#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// A mesh that Gmsh made; nodes in the order of Gmsh's numbers, without those of no element.
struct GmshMesh {
  Mesh mesh;
  /// The node of each of Gmsh's numbers, -1 for none.
  std::vector<NodeId> node_of_tag;
};

/// Runs `build`, which fills Gmsh's model, meshes it up to `dimension` and takes its triangles (2)
/// or tetrahedra (3), then runs `use` while the model is there. Throws `Error` (GENERATOR_FAILED)
/// with Gmsh's words, which begin with `name`.
[[nodiscard]] Mesh make_with_gmsh(const std::string& name, int dimension,
                                  const std::function<void()>& build,
                                  const std::function<void(GmshMesh&)>& use);

/// Calls `visit(node)` for the mesh's nodes on an entity of Gmsh's model, its ends included.
void for_each_node_of(const GmshMesh& mesh, int dimension, int entity,
                      const std::function<void(std::size_t)>& visit);

}  // namespace meshsmooth::formats

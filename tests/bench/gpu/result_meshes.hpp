#pragma once

#include <string>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::bench {

/// A mesh whose results are recorded, float64.
struct ResultMesh {
  std::string name;
  Mesh mesh;
};

/// Five small meshes, the same on every run:
///   cube     Delaunay tetrahedra of the unit cube, valid
///   tangled  Delaunay tetrahedra of the unit ball, a tenth inverted
///   mixed    hexahedra, wedges, pyramids and tetrahedra of a cube with bulging faces, two regions
///   grid     jittered hexahedra; some nodes fixed by the caller, one in no element
///   surface  open curved triangle surface with noise
/// Coordinates that need the C library's functions may differ in the last bit where that is
/// another version; `mesh_hash` tells.
[[nodiscard]] std::vector<ResultMesh> make_result_meshes();

}  // namespace meshsmooth::bench

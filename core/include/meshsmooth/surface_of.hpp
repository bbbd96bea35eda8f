#pragma once

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/target_surface.hpp"

namespace meshsmooth {

/// The triangles of a surface mesh: quads as two triangles each, elements of second order as those
/// between all their nodes; regions become patches. O(elements).
///
/// @throws InvalidMesh SURFACE_INVALID: the mesh has volume elements
[[nodiscard]] SurfaceMesh surface_of(const Mesh& mesh);

}  // namespace meshsmooth

#pragma once

#include <filesystem>
#include <string>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// A mesh of another format as SU2 has it. Lower-dimensional cells on the boundary become elements
/// of markers: by the names of physical groups, else by the numbers of the arrays "su2:marker" or
/// "gmsh:physical" ("marker_1"); others are in the marker "unnamed". `path` is for messages.
/// Throws ELEMENT_NOT_SUPPORTED, FORMAT_ERROR (a surface that is not in the plane z = 0).
[[nodiscard]] std::string make_su2(const std::filesystem::path& path, const MeshFile& file);

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// A mesh of another format as bulk data in large fields. Physical groups, else entities, become
/// properties, which the deck does not define; their names stand in comments as ANSA writes them.
/// Lower-dimensional edges become CROD and CBEAM3, points CONM2 without a mass. Throws
/// ELEMENT_NOT_SUPPORTED.
[[nodiscard]] std::string make_nastran(const std::filesystem::path& path, const MeshFile& file);

}  // namespace meshsmooth::formats

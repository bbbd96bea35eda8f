#pragma once

#include <filesystem>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// Throws FORMAT_ERROR unless all nodes are in the plane z = 0, where `file` in two dimensions
/// lies.
void check_plane(const std::filesystem::path& file, const Mesh& mesh);

}  // namespace meshsmooth::formats

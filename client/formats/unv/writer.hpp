#pragma once

#include <filesystem>
#include <string>

#include "mesh_file.hpp"

namespace meshsmooth::formats::unv {

/// A mesh of another format as a universal file: data sets 2411, 2412 and, for its physical groups
/// and node sets, 2467. Points are left out but as members of groups. `path` is for messages.
/// Throws ELEMENT_NOT_SUPPORTED.
[[nodiscard]] std::string make_text(const std::filesystem::path& path, const MeshFile& file);

}  // namespace meshsmooth::formats::unv

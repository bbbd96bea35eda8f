#pragma once

#include <filesystem>
#include <string_view>

#include "coordinate_fields.hpp"

namespace meshsmooth::formats {

/// Finds the node coordinates in a file of one of Gmsh's formats (by the
/// path's extension). Gmsh itself reads and writes the rest: its writers print
/// 6 to 16 digits, too few for a double, and its readers drop nodes that no
/// element uses and the order of the nodes. Throws FILE_TRUNCATED,
/// FORMAT_ERROR; a file that is not of its format is refused here, before Gmsh
/// takes it for a script and runs it.
[[nodiscard]] CoordinateFields find_coordinates(const std::filesystem::path& path,
                                                std::string_view text);

}  // namespace meshsmooth::formats

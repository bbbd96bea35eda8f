#pragma once

#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// Whose mesh a text with the extension .msh is, where it is not Gmsh's: several programs use the
/// extension. "a FreeFEM mesh"; empty: not known. O(first lines).
[[nodiscard]] std::string foreign_mesh_name(std::string_view text);

}  // namespace meshsmooth::formats

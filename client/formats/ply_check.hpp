#pragma once

#include <filesystem>
#include <string_view>

namespace meshsmooth::formats {

/// Throws FORMAT_ERROR or FILE_TRUNCATED unless the bytes hold all that the
/// PLY header announces. VTK's reader crashes on a file that was cut off.
void check_ply(const std::filesystem::path& path, std::string_view bytes);

}  // namespace meshsmooth::formats

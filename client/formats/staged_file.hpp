#pragma once

#include <filesystem>

#include "readers.hpp"

namespace meshsmooth::formats {

/// Whether a format's reader can open the file itself: it is no pipe, not compressed, and has the
/// extension by which libraries choose the format, in lower case.
[[nodiscard]] bool is_plain(const std::filesystem::path& file, const Format& format);

/// Reads a file that is not plain from a copy that is, for readers that look for no other file
/// beside it. Errors name the file. Throws as `Format::read` and `read_bytes`.
[[nodiscard]] MeshFile read_staged(const std::filesystem::path& file, const Format& format);

}  // namespace meshsmooth::formats

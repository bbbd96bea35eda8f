#pragma once

#include <filesystem>
#include <string_view>

namespace meshsmooth::cli {

/// Throws `Error` (FILE_NOT_WRITABLE) unless a file can be written there.
/// Leaves nothing behind.
void check_text_file_writable(const std::filesystem::path& path);

/// Replaces `path` when all has been written, never before; makes its folder where there is none.
/// Throws `Error` (FILE_NOT_WRITABLE).
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace meshsmooth::cli

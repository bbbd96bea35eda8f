#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace meshsmooth::formats {

/// Whether bytes begin as gzip's do, whatever the file is called. RFC 1952, section 2.3.1.
[[nodiscard]] bool is_gzip(std::string_view bytes);

/// Whether the name ends in ".gz", in any letter case.
[[nodiscard]] bool is_gzip_name(const std::filesystem::path& path);

/// What was compressed, all members of it; zeros after the last one are padding. `path` is for
/// messages. Throws FILE_TRUNCATED, FORMAT_ERROR. O(result).
[[nodiscard]] std::string decompress_gzip(const std::filesystem::path& path,
                                          std::string_view bytes);

/// Compresses one file into another. The header has neither name nor time: the same bytes give the
/// same file. Throws FILE_NOT_READABLE, FILE_NOT_WRITABLE. O(file), in constant memory.
void compress_gzip(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string>

#include "readers.hpp"

namespace meshsmooth::formats {

/// The format called `named` ("inp", ".INP") or, where that is empty, that a file's name tells;
/// null: unknown.
[[nodiscard]] const Format* find_format(const std::filesystem::path& file,
                                        const std::string& named);

/// The format to read a file in. Throws FORMAT_UNKNOWN, also where the file's companion could not
/// be found.
[[nodiscard]] const Format& readable_format(const std::filesystem::path& file,
                                            const std::string& named);

/// The format to write a file in; that of `source`, a file's name or extension, where a pipe's
/// name does not tell. Throws FORMAT_UNKNOWN, also where the format is written from its own files
/// only and `source` is none of them.
[[nodiscard]] const Format& writable_format(const std::filesystem::path& file,
                                            const std::string& named,
                                            const std::filesystem::path& source);

}  // namespace meshsmooth::formats

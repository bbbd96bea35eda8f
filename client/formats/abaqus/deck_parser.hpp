#pragma once

#include <filesystem>

#include "content.hpp"

namespace meshsmooth::formats {

/// Reads a deck of Abaqus or CalculiX and the files that it includes, all but
/// `FileContent::extension`. Throws FORMAT_ERROR, FILE_TRUNCATED, FILE_NOT_FOUND.
void read_deck(const std::filesystem::path& file, FileContent& content);

}  // namespace meshsmooth::formats

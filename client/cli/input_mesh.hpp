#pragma once

#include <string>

#include "mesh_file.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {

/// Where an error lies, in the file's own ids: " (in the file: element 12)".
/// Empty when the error names no place or the file counts from 0 as we do.
[[nodiscard]] std::string place_in_file(const ErrorDetails& details, const formats::MeshFile& file);

}  // namespace meshsmooth::cli

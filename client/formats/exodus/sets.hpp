#pragma once

#include <cstdint>

#include "content.hpp"
#include "exodus/blocks.hpp"
#include "netcdf_file.hpp"

namespace meshsmooth::formats {

/// The node sets, side sets and element sets, all as sets of nodes. Throws FORMAT_ERROR.
void read_exodus_sets(const NetcdfFile& file, const ExodusMesh& mesh, std::int64_t node_count,
                      FileContent& content);

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string_view>

namespace meshsmooth::formats {

/// Checks that no name, list or value in the header of a classic netCDF file (versions 1, 2 and 5)
/// is longer than the file, that all values are in it, and that variables have types and sizes: the
/// library reads for minutes before it sees that, fills the file up when it writes it, or divides
/// by zero. Bytes that begin in another way are left to the library. Throws FILE_TRUNCATED,
/// FORMAT_ERROR. O(header).
/// Source: NetCDF Classic Format Specification, Unidata.
void check_classic_header(const std::filesystem::path& path, std::string_view bytes);

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dataset.hpp"
#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// Where the coordinates of some nodes stand in a file of arrays (HDF5, netCDF, ADF).
struct CoordinateArrays {
  std::vector<std::string> names;  // one for each axis, or one of all
  std::size_t dimension = 3;       // 2: z is 0 and not in the file
  bool by_axis = true;             // one of all: first all x, then all y …; or node by node
  bool single_precision = false;
  std::size_t first_node = 0;  // of the mesh
  std::size_t node_count = 0;
};

/// From the numbers in the arrays, in the order of `names`. Throws FORMAT_ERROR.
[[nodiscard]] Positions positions_of(const std::filesystem::path& path,
                                     const CoordinateArrays& arrays,
                                     const std::vector<std::vector<double>>& numbers);

/// Puts nodes behind others; in double precision where one of both are.
void append_positions(Positions& to, const Positions& more);

/// The numbers for the arrays, from the positions of all nodes of the mesh. Throws
/// FILE_NOT_WRITABLE where z is needed but not in the file.
[[nodiscard]] std::vector<std::vector<double>> numbers_of(const std::filesystem::path& path,
                                                          const CoordinateArrays& arrays,
                                                          const PositionsView& positions);

/// Whether any bit differs from what was read.
[[nodiscard]] bool has_moved(const Positions& read, const PositionsView& positions);

/// Writes the bytes of an HDF5 file, then the mesh's positions in place of those that were read;
/// the very bytes where none has moved. O(bytes).
void write_hdf5(const std::filesystem::path& path, const std::string& bytes, const MeshFile& file);

}  // namespace meshsmooth::formats

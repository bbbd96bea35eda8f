#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// What two mesh files were compared by.
enum class ComparedBy {
  bytes,   // each byte outside the coordinates
  arrays,  // files in the hands of a library: cells, arrays, ids, groups and sets
  meshes,  // files of different formats: nodes and elements alone
};

[[nodiscard]] std::string_view compared_by_name(ComparedBy compared_by);

/// How two files differ beside their coordinates.
struct FileDifference {
  ComparedBy compared_by = ComparedBy::meshes;
  bool same_topology = false;  // as many nodes, the same elements of the same nodes in their order
  /// The first difference of each kind, with its place; empty: coordinates alone may differ.
  std::vector<std::string> differences;

  [[nodiscard]] bool only_coordinates() const { return differences.empty(); }
};

/// O(size of both files).
[[nodiscard]] FileDifference compare_files(const MeshFile& a, const MeshFile& b);

}  // namespace meshsmooth::formats

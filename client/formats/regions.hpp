#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mesh_file.hpp"

namespace meshsmooth::formats {

/// The parts (materials, physical groups) of a mesh.
struct Regions {
  std::string array;  // that tells them apart; empty: nothing does
  std::size_t count = 1;
  /// By element, numbered from 0 in the order of the array's values; empty with one region.
  std::vector<std::int32_t> of_element;
};

/// By the first of these that tells of the mesh's elements anything but 0: Gmsh's physical
/// groups ("gmsh:physical"; elements of one region are in the same groups), Medit's
/// references ("medit:ref"), TetGen's first attribute ("tetgen:attribute_0"), MED's families
/// ("med:family"), Exodus' blocks ("exodus:block"), Gmsh's geometrical entities
/// ("gmsh:geometrical"), the materials of an Abaqus deck ("abaqus:material"), the cell zones of
/// OpenFOAM ("foam:cell_zone"), the zones of SU2 ("su2:zone"). O(cells log regions).
[[nodiscard]] Regions find_regions(const MeshFile& file);

/// By the cell array of this name: one value a cell, whole numbers; TetGen's attributes may
/// be any. Throws `InvalidOption`: NAME_UNKNOWN, which lists the arrays that there are, and
/// ARRAY_NOT_WHOLE.
[[nodiscard]] Regions find_regions(const MeshFile& file, const std::string& array);

}  // namespace meshsmooth::formats

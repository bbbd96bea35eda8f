#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "cells.hpp"

namespace meshsmooth::formats {

/// A type of element that an MSH file may have.
struct MshElementType {
  const CellKind* kind = nullptr;  // null: its nodes are held in place
  int cell_type = 0;               // of a polygon or polyhedron
  std::string_view own_name = {};  // of what has no type elsewhere
  int dimension = 0;
  int node_count = 0;  // 0: each element says how many

  [[nodiscard]] bool is_known() const {
    return kind != nullptr || cell_type != 0 || !own_name.empty();
  }
};

/// By Gmsh's number of the type. Throws ELEMENT_NOT_SUPPORTED for a number that Gmsh has not, which
/// names the element. O(1).
[[nodiscard]] const MshElementType& msh_element_type(const std::filesystem::path& path, int type,
                                                     std::int64_t element);

}  // namespace meshsmooth::formats

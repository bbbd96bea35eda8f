#pragma once

#include <cstdint>
#include <string>

#include "cells.hpp"

namespace meshsmooth::formats {

// Numbers of CGNS's ElementType_t.
inline constexpr std::int64_t kCgnsMixed = 20;
inline constexpr std::int64_t kCgnsPolygons = 22;     // NGON_n
inline constexpr std::int64_t kCgnsPolyhedra = 23;    // NFACE_n
inline constexpr std::int64_t kCgnsOldPolygons = 21;  // before version 3; the node count is added

/// Null: elements of this type cannot be smoothed.
[[nodiscard]] const CellKind* find_cgns_kind(std::int64_t type);
/// "PYRA_14".
[[nodiscard]] std::string cgns_type_name(std::int64_t type);

}  // namespace meshsmooth::formats

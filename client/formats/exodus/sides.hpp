#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cells.hpp"

namespace meshsmooth::formats {

/// An element type of Exodus'.
struct ExodusShape {
  const CellKind* kind;
  bool shell;  // its sides 1 and 2 are its faces, the others its edges
};

/// "TETRA", "HEX8" …, in any case, of a mesh in two or three dimensions; none: of a higher order,
/// or unknown.
[[nodiscard]] std::optional<ExodusShape> find_exodus_shape(const std::string& type,
                                                           std::size_t node_count,
                                                           std::size_t dimension);
/// Whether the type is one of Exodus', of whatever order.
[[nodiscard]] bool is_exodus_type(const std::string& type);

struct ExodusSide {
  std::vector<int>
      nodes;  // by their places in the element, from 0, in Exodus' order; corners first
  std::size_t corner_count;
  bool facet;  // not the face of a shell, which is the shell itself
};

/// A side, which counts from 1; without nodes: there is no such side. From the tables of side sets
/// in "EXODUS II: A Finite Element Data Model" (Sandia, SAND92-2137).
[[nodiscard]] ExodusSide find_exodus_side(const ExodusShape& shape, std::int64_t side);

}  // namespace meshsmooth::formats

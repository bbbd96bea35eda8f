#include "exodus_sides.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

using Sides = std::vector<std::vector<int>>;

const Sides& sides_of(const ExodusShape& shape) {
  static const Sides line = {{0}, {1}};
  static const Sides triangle = {{0, 1}, {1, 2}, {2, 0}};
  static const Sides quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  static const Sides triangle_shell = {{0, 1, 2}, {0, 2, 1}, {0, 1}, {1, 2}, {2, 0}};
  static const Sides quad_shell = {{0, 1, 2, 3}, {0, 3, 2, 1}, {0, 1}, {1, 2}, {2, 3}, {3, 0}};
  static const Sides tetrahedron = {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}};
  static const Sides pyramid = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {0, 4, 3}, {0, 3, 2, 1}};
  static const Sides wedge = {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}};
  static const Sides hexahedron = {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6},
                                   {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  static const Sides none;
  switch (shape.kind->vtk_type) {
    case kLineCell:
      return line;
    case kTriangleCell:
      return shape.shell ? triangle_shell : triangle;
    case kQuadCell:
      return shape.shell ? quad_shell : quad;
    case kTetrahedronCell:
      return tetrahedron;
    case kPyramidCell:
      return pyramid;
    case kWedgeCell:
      return wedge;
    case kHexahedronCell:
      return hexahedron;
    default:
      return none;
  }
}

}  // namespace

std::optional<ExodusShape> find_exodus_shape(std::string type, std::size_t node_count) {
  std::ranges::transform(type, type.begin(),
                         [](unsigned char letter) { return std::toupper(letter); });
  const auto is = [&](const char* prefix) { return type.starts_with(prefix); };
  const bool shell = is("SHELL") || is("TRISH");
  int cell = 0;
  if (is("TET")) cell = kTetrahedronCell;
  if (is("HEX")) cell = kHexahedronCell;
  if (is("WED")) cell = kWedgeCell;
  if (is("PYR")) cell = kPyramidCell;
  if (is("TRI") || (is("SHELL") && node_count == 3)) cell = kTriangleCell;
  if (is("QUA") || (is("SHELL") && node_count == 4)) cell = kQuadCell;
  if (is("BAR") || is("BEA") || is("EDG") || is("ROD") || is("TRU")) cell = kLineCell;
  if (is("SPH") || is("CIR") || is("POI") || is("NOD")) cell = kVertexCell;
  const CellKind* kind = find_vtk_cell(cell, node_count);
  if (kind == nullptr) return std::nullopt;
  return ExodusShape{kind, shell};
}

std::span<const int> nodes_of_exodus_side(const ExodusShape& shape, std::int64_t side) {
  const Sides& sides = sides_of(shape);
  if (side < 1 || side > static_cast<std::int64_t>(sides.size())) return {};
  return sides[static_cast<std::size_t>(side - 1)];
}

}  // namespace meshsmooth::formats

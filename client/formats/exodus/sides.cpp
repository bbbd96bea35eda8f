#include "exodus/sides.hpp"

#include <algorithm>
#include <cctype>
#include <span>
#include <string_view>

#include "dataset.hpp"
#include "node_orders.hpp"

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
  if (!shape.kind->element) return line;
  switch (linear_type(*shape.kind->element)) {
    case ElementType::triangle:
      return shape.shell ? triangle_shell : triangle;
    case ElementType::quad:
      return shape.shell ? quad_shell : quad;
    case ElementType::tetrahedron:
      return tetrahedron;
    case ElementType::pyramid:
      return pyramid;
    case ElementType::wedge:
      return wedge;
    default:
      return hexahedron;
  }
}

/// The cell of `node_count` nodes whose corners form a linear one.
const CellKind* find_kind(int linear_cell, std::size_t node_count) {
  if (linear_cell == kLineCell && node_count == 3) return find_vtk_cell(kEdge3Cell);
  for (const ElementType type : kElementTypes) {
    if (element_width(type) != node_count) continue;
    if (cell_kind(linear_type(type)).vtk_type == linear_cell) return &cell_kind(type);
  }
  return find_vtk_cell(linear_cell, node_count);
}

std::string in_capitals(std::string type) {
  std::ranges::transform(type, type.begin(),
                         [](unsigned char letter) { return std::toupper(letter); });
  return type;
}

/// The linear cell by the first letters of its name; 0: none has such a name.
int cell_named(std::string_view name) {
  const auto is = [&](const char* prefix) { return name.starts_with(prefix); };
  if (is("TET")) return kTetrahedronCell;
  if (is("HEX")) return kHexahedronCell;
  if (is("WED")) return kWedgeCell;
  if (is("PYR")) return kPyramidCell;
  if (is("TRI")) return kTriangleCell;
  if (is("QUA")) return kQuadCell;
  if (is("BAR") || is("BEA") || is("EDG") || is("ROD") || is("TRU")) return kLineCell;
  if (is("SPH") || is("CIR") || is("POI") || is("NOD")) return kVertexCell;
  return 0;
}

}  // namespace

std::optional<ExodusShape> find_exodus_shape(const std::string& type, std::size_t node_count,
                                             std::size_t dimension) {
  const std::string name = in_capitals(type);
  const bool is_shell = name.starts_with("SHELL");
  int cell = cell_named(name);
  if (is_shell && node_count == 2) {
    cell = kLineCell;  // in two dimensions
  } else if (is_shell) {
    cell = node_count == 3 || node_count == 6 ? kTriangleCell : kQuadCell;
  }
  const CellKind* kind = find_kind(cell, node_count);
  if (kind == nullptr) return std::nullopt;
  // A surface in space has two faces, whatever it is called.
  const bool named_so = is_shell || name.starts_with("TRISH");
  return ExodusShape{kind, kind->dimension == 2 && (dimension == 3 || named_so)};
}

bool is_exodus_type(const std::string& type) {
  const std::string name = in_capitals(type);
  return cell_named(name) != 0 || name.starts_with("SHELL");
}

ExodusSide find_exodus_side(const ExodusShape& shape, std::int64_t side) {
  if (shape.kind->dimension == 0 && side == 1) return {{0}, 1, false};
  const Sides& sides = sides_of(shape);
  if (shape.kind->dimension == 0 || side < 1 || side > static_cast<std::int64_t>(sides.size()))
    return {{}, 0, false};
  const std::vector<int>& corners = sides[static_cast<std::size_t>(side - 1)];
  ExodusSide found{corners, corners.size(), !shape.shell || side > 2};
  if (!shape.kind->element) return found;
  const auto places = places_in(NodeOrder::exodus, *shape.kind);
  const auto on_side = [&](std::int8_t corner) {
    return std::ranges::find(corners, places[static_cast<std::size_t>(corner)]) != corners.end();
  };
  std::size_t node = element_width(linear_type(*shape.kind->element));
  for (const MidNode& mid : mid_nodes(*shape.kind->element)) {
    const auto of = std::span(mid.corners).first(static_cast<std::size_t>(mid.corner_count));
    if (std::ranges::all_of(of, on_side)) found.nodes.push_back(places[node]);
    ++node;
  }
  return found;
}

}  // namespace meshsmooth::formats

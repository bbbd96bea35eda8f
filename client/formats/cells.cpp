#include "cells.hpp"

#include <vtkCellType.h>
#include <vtkCellTypes.h>

#include <algorithm>
#include <cctype>

namespace meshsmooth::formats {
namespace {

constexpr std::array<std::int8_t, 8> kSame = {0, 1, 2, 3, 4, 5, 6, 7};

// VTK lets the normal of a wedge's first triangle point out of the wedge, Gmsh
// into it.
constexpr std::array<std::int8_t, 8> kOtherTurn = {0, 2, 1, 3, 5, 4, 6, 7};

constexpr std::array<CellKind, 8> kKinds = {{
    {"point", VTK_VERTEX, 15, 0, 1, std::nullopt, kSame},
    {"edge", VTK_LINE, 1, 1, 2, std::nullopt, kSame},
    {"triangle", VTK_TRIANGLE, 2, 2, 3, ElementType::triangle, kSame},
    {"quad", VTK_QUAD, 3, 2, 4, ElementType::quad, kSame},
    {"tetrahedron", VTK_TETRA, 4, 3, 4, ElementType::tetrahedron, kSame},
    {"pyramid", VTK_PYRAMID, 7, 3, 5, ElementType::pyramid, kSame},
    {"wedge", VTK_WEDGE, 6, 3, 6, ElementType::wedge, kOtherTurn},
    {"hexahedron", VTK_HEXAHEDRON, 5, 3, 8, ElementType::hexahedron, kSame},
}};

template <class Rule>
const CellKind* find_kind(Rule rule) {
  const auto* found = std::find_if(kKinds.begin(), kKinds.end(), rule);
  return found == kKinds.end() ? nullptr : found;
}

}  // namespace

const CellKind* find_vtk_cell(int vtk_type, std::int64_t node_count) {
  if (vtk_type == VTK_POLYGON && node_count == 3) vtk_type = VTK_TRIANGLE;
  if (vtk_type == VTK_POLYGON && node_count == 4) vtk_type = VTK_QUAD;
  return find_kind([&](const CellKind& kind) {
    return kind.vtk_type == vtk_type && kind.node_count == node_count;
  });
}

const CellKind* find_gmsh_cell(int gmsh_type) {
  return find_kind([&](const CellKind& kind) { return kind.gmsh_type == gmsh_type; });
}

const CellKind& cell_kind(ElementType type) {
  return *find_kind([&](const CellKind& kind) { return kind.element == type; });
}

std::string vtk_cell_name(int vtk_type) {
  const std::string class_name = vtkCellTypes::GetClassNameFromTypeId(vtk_type);
  const std::string number = "VTK cell type " + std::to_string(vtk_type);
  if (class_name == "UnknownClass") return number;
  std::string words;  // "vtkQuadraticTetra" -> "quadratic tetra"
  for (const char letter : class_name.substr(class_name.starts_with("vtk") ? 3 : 0)) {
    const auto code = static_cast<unsigned char>(letter);
    if (std::isupper(code) && !words.empty()) words += ' ';
    words += static_cast<char>(std::tolower(code));
  }
  return words + " (" + number + ")";
}

}  // namespace meshsmooth::formats

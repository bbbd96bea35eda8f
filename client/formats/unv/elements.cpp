#include "unv/elements.hpp"

#include <algorithm>
#include <array>

#include "dataset.hpp"

namespace meshsmooth::formats::unv {
namespace {

struct Solid {
  int descriptor;
  int vtk_type;
};

// FE descriptors as in the description of data set 2412. The solids and thick shells:
constexpr auto kSolids = std::to_array<Solid>({
    {101, kWedgeCell},
    {102, kWedge15Cell},
    {104, kHexahedronCell},
    {105, kHexahedron20Cell},
    {111, kTetrahedronCell},
    {112, kWedgeCell},
    {113, kWedge15Cell},
    {115, kHexahedronCell},
    {116, kHexahedron20Cell},
    {118, kTetrahedron10Cell},
    {312, kPyramidCell},
});

// Rods, beams, pipes, rigid bars, springs, dampers and gaps between two nodes, axisymmetric
// shells, runners of moulds.
constexpr auto kLines = std::to_array<int>(
    {11, 21, 22, 23, 24, 31, 32, 121, 136, 137, 141, 151, 171, 172, 191, 192, 193, 194, 195, 196});

// Springs, dampers and gaps to the ground, lumped masses.
constexpr auto kPoints = std::to_array<int>({138, 139, 142, 152, 161});

/// Plane stress, plane strain, plate, membrane, axisymmetric solid, thin shell. Documents disagree
/// on which of the membranes' descriptors are triangles, so the number of nodes decides.
bool is_surface(std::int64_t descriptor) {
  const std::int64_t family = descriptor / 10;
  const std::int64_t member = descriptor % 10;
  const bool cubic = member == 3 || member == 6;
  return family >= 4 && family <= 9 && member >= 1 && member <= 5 && !cubic;
}

template <class List>
bool has(const List& list, std::int64_t descriptor) {
  return std::ranges::find(list, descriptor) != list.end();
}

}  // namespace

const CellKind* find_kind(std::int64_t descriptor, std::size_t node_count) {
  if (is_surface(descriptor)) {
    switch (node_count) {
      case 3:
        return find_vtk_cell(kTriangleCell);
      case 4:
        return find_vtk_cell(kQuadCell);
      case 6:
        return find_vtk_cell(kTriangle6Cell);
      case 8:
        return find_vtk_cell(kQuad8Cell);
      default:
        return nullptr;
    }
  }
  if (has(kLines, descriptor) || has(kPoints, descriptor)) {
    if (node_count == 1) return find_vtk_cell(kVertexCell);
    if (node_count == 2) return find_vtk_cell(kLineCell);
    return node_count == 3 ? find_vtk_cell(kEdge3Cell) : nullptr;
  }
  const auto* solid = std::ranges::find(kSolids, descriptor, &Solid::descriptor);
  return solid == kSolids.end() ? nullptr : find_vtk_cell(solid->vtk_type, node_count);
}

bool may_have_section(std::int64_t descriptor) { return descriptor >= 11 && descriptor <= 32; }

std::optional<int> descriptor_of(const CellKind& kind) {
  switch (kind.vtk_type) {
    case kLineCell:
      return 21;
    case kEdge3Cell:
      return 24;
    case kTriangleCell:
      return 91;
    case kTriangle6Cell:
      return 92;
    case kQuadCell:
      return 94;
    case kQuad8Cell:
      return 95;
    case kTetrahedronCell:
      return 111;
    case kWedgeCell:
      return 112;
    case kWedge15Cell:
      return 113;
    case kHexahedronCell:
      return 115;
    case kHexahedron20Cell:
      return 116;
    case kTetrahedron10Cell:
      return 118;
    default:  // other programs know no pyramids in these files
      return std::nullopt;
  }
}

}  // namespace meshsmooth::formats::unv

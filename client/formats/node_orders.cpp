#include "node_orders.hpp"

#include <algorithm>
#include <array>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

using Places = std::array<std::int8_t, kMaxCellNodes>;

struct Row {
  NodeOrder order;
  int vtk_type;
  Places places;
};

// clang-format off
constexpr Places kSame = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13,
                          14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26};

// Corners, edges of the first face, of the second, between them; faces; the centre.
constexpr Places kMirroredTetrahedron = {0, 2, 1, 3,  6, 5, 4,  7, 9, 8};
constexpr Places kMirroredPyramid = {0, 3, 2, 1, 4,  8, 7, 6, 5,  9, 12, 11, 10};
constexpr Places kMirroredWedge = {0, 2, 1, 3, 5, 4,  8, 7, 6,  11, 10, 9,  12, 14, 13,  17, 16, 15};
constexpr Places kMirroredHexahedron = {0, 3, 2, 1, 4, 7, 6, 5,  11, 10, 9, 8,  15, 14, 13, 12,
                                        16, 19, 18, 17,  22, 23, 20, 21, 24, 25,  26};

constexpr Places kGmshWedge = {0, 2, 1, 3, 5, 4,  7, 9, 6,  13, 14, 12,  8, 11, 10,  16, 17, 15};
constexpr Places kGmshHexahedron = {0, 1, 2, 3, 4, 5, 6, 7,  8, 11, 13, 9,  16, 18, 19, 17,
                                    10, 12, 14, 15,  22, 23, 21, 24, 20, 25,  26};

constexpr Places kExodusWedge = {0, 2, 1, 3, 5, 4,  8, 7, 6,  14, 13, 12,  9, 11, 10,  17, 16, 15};
constexpr Places kExodusHexahedron = {0, 1, 2, 3, 4, 5, 6, 7,  8, 9, 10, 11,  16, 17, 18, 19,
                                      12, 13, 14, 15,  23, 24, 25, 26, 21, 22,  20};

// Checked by nodes in the middle of their corners: Gmsh's and MED's in files of Gmsh and medcoupling,
// TetGen's in its own files, those of Exodus II (SAND92-2137) and CGNS (SIDS, "Unstructured grid
// element numbering conventions") by VTK's readers, Abaqus' by volumes that CalculiX computes.
constexpr auto kRows = std::to_array<Row>({
    {NodeOrder::gmsh, kTetrahedron10Cell, {0, 1, 2, 3,  4, 5, 6,  7, 9, 8}},
    {NodeOrder::gmsh, kPyramid13Cell, {0, 1, 2, 3, 4,  5, 8, 10, 6,  7, 9, 11, 12}},
    {NodeOrder::gmsh, kWedgeCell, kGmshWedge},
    {NodeOrder::gmsh, kWedge15Cell, kGmshWedge},
    {NodeOrder::gmsh, kWedge18Cell, kGmshWedge},
    {NodeOrder::gmsh, kHexahedron20Cell, kGmshHexahedron},
    {NodeOrder::gmsh, kHexahedron27Cell, kGmshHexahedron},

    {NodeOrder::abaqus, kEdge3Cell, {0, 2, 1}},
    {NodeOrder::abaqus, kWedgeCell, kMirroredWedge},
    {NodeOrder::abaqus, kWedge15Cell, kMirroredWedge},

    {NodeOrder::exodus, kWedgeCell, kExodusWedge},
    {NodeOrder::exodus, kWedge15Cell, kExodusWedge},
    {NodeOrder::exodus, kWedge18Cell, kExodusWedge},
    {NodeOrder::exodus, kHexahedron20Cell, kExodusHexahedron},
    {NodeOrder::exodus, kHexahedron27Cell, kExodusHexahedron},

    {NodeOrder::cgns, kWedgeCell, kExodusWedge},
    {NodeOrder::cgns, kWedge15Cell, kExodusWedge},
    {NodeOrder::cgns, kWedge18Cell, kExodusWedge},
    {NodeOrder::cgns, kHexahedron20Cell, kExodusHexahedron},
    {NodeOrder::cgns, kHexahedron27Cell,
     {0, 1, 2, 3, 4, 5, 6, 7,  8, 9, 10, 11,  16, 17, 18, 19,  12, 13, 14, 15,
      24, 22, 21, 23, 20, 25,  26}},

    {NodeOrder::med, kTetrahedronCell, kMirroredTetrahedron},
    {NodeOrder::med, kTetrahedron10Cell, kMirroredTetrahedron},
    {NodeOrder::med, kPyramidCell, kMirroredPyramid},
    {NodeOrder::med, kPyramid13Cell, kMirroredPyramid},
    {NodeOrder::med, kHexahedronCell, kMirroredHexahedron},
    {NodeOrder::med, kHexahedron20Cell, kMirroredHexahedron},
    {NodeOrder::med, kHexahedron27Cell,
     {0, 3, 2, 1, 4, 7, 6, 5,  11, 10, 9, 8,  15, 14, 13, 12,  16, 19, 18, 17,
      21, 23, 24, 22, 20, 25,  26}},

    {NodeOrder::tetgen, kTetrahedron10Cell, {0, 1, 2, 3,  6, 7, 9,  5, 8, 4}},

    {NodeOrder::unv, kEdge3Cell, {0, 2, 1}},
    {NodeOrder::unv, kTriangle6Cell, {0, 2, 4,  1, 3, 5}},
    {NodeOrder::unv, kQuad8Cell, {0, 2, 4, 6,  1, 3, 5, 7}},
    {NodeOrder::unv, kTetrahedron10Cell, {0, 2, 4, 9,  1, 3, 5,  6, 7, 8}},
    {NodeOrder::unv, kWedgeCell, kMirroredWedge},
    {NodeOrder::unv, kWedge15Cell, {0, 4, 2, 9, 13, 11,  5, 3, 1,  14, 12, 10,  6, 8, 7}},
    {NodeOrder::unv, kHexahedron20Cell,
     {0, 2, 4, 6, 12, 14, 16, 18,  1, 3, 5, 7,  13, 15, 17, 19,  8, 9, 10, 11}},

    {NodeOrder::mirrored, kTetrahedronCell, kMirroredTetrahedron},
    {NodeOrder::mirrored, kTetrahedron10Cell, kMirroredTetrahedron},
    {NodeOrder::mirrored, kPyramidCell, kMirroredPyramid},
    {NodeOrder::mirrored, kPyramid13Cell, kMirroredPyramid},
    {NodeOrder::mirrored, kWedgeCell, kMirroredWedge},
    {NodeOrder::mirrored, kWedge15Cell, kMirroredWedge},
    {NodeOrder::mirrored, kWedge18Cell, kMirroredWedge},
    {NodeOrder::mirrored, kHexahedronCell, kMirroredHexahedron},
    {NodeOrder::mirrored, kHexahedron20Cell, kMirroredHexahedron},
    {NodeOrder::mirrored, kHexahedron27Cell, kMirroredHexahedron},
});
// clang-format on

}  // namespace

std::span<const std::int8_t> places_in(NodeOrder order, const CellKind& kind) {
  const auto* found = std::ranges::find_if(
      kRows, [&](const Row& row) { return row.order == order && row.vtk_type == kind.vtk_type; });
  const Places& places = found == kRows.end() ? kSame : found->places;
  return std::span(places).first(static_cast<std::size_t>(kind.node_count));
}

}  // namespace meshsmooth::formats

#include "cgns/types.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

/// By the number of CGNS's ElementType_t.
constexpr auto kTypes = std::to_array<std::pair<std::int64_t, int>>({{2, kVertexCell},
                                                                     {3, kLineCell},
                                                                     {4, kEdge3Cell},
                                                                     {5, kTriangleCell},
                                                                     {6, kTriangle6Cell},
                                                                     {7, kQuadCell},
                                                                     {8, kQuad8Cell},
                                                                     {9, kQuad9Cell},
                                                                     {10, kTetrahedronCell},
                                                                     {11, kTetrahedron10Cell},
                                                                     {12, kPyramidCell},
                                                                     {14, kWedgeCell},
                                                                     {15, kWedge15Cell},
                                                                     {16, kWedge18Cell},
                                                                     {17, kHexahedronCell},
                                                                     {18, kHexahedron20Cell},
                                                                     {19, kHexahedron27Cell},
                                                                     {21, kPyramid13Cell}});
/// Of ElementType_t that cannot be smoothed, from its number 22 on, but for PYRA_14.
constexpr auto kHigherOrder = std::to_array<std::string_view>(
    {"NGON_n", "NFACE_n", "BAR_4", "TRI_9", "TRI_10", "QUAD_12", "QUAD_16", "TETRA_16", "TETRA_20",
     "PYRA_21", "PYRA_29", "PYRA_30", "PENTA_24", "PENTA_38", "PENTA_40", "HEXA_32", "HEXA_56",
     "HEXA_64"});

}  // namespace

std::string cgns_type_name(std::int64_t type) {
  const auto place = static_cast<std::uint64_t>(type) - kCgnsPolygons;
  if (type == 13) return "PYRA_14";
  if (place < kHigherOrder.size()) return std::string(kHigherOrder[place]);
  return "number " + std::to_string(type) + " of CGNS";
}

const CellKind* find_cgns_kind(std::int64_t type) {
  const auto* known = std::ranges::find(kTypes, type, &std::pair<std::int64_t, int>::first);
  return known == kTypes.end() ? nullptr : find_vtk_cell(known->second);
}

}  // namespace meshsmooth::formats

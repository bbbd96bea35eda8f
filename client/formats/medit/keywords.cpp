#include "medit/keywords.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "dataset.hpp"

namespace meshsmooth::formats::medit {
namespace {

// Names and codes as libMeshb has them; those of code 0 are of mmg and of old files.
constexpr auto kKeywords = std::to_array<Keyword>({
    {"Vertices", kVerticesCode, Role::vertices},
    {"Edges", 5, Role::cells, 2, kLineCell},
    {"Triangles", 6, Role::cells, 3, kTriangleCell},
    {"Quadrilaterals", 7, Role::cells, 4, kQuadCell},
    {"Tetrahedra", 8, Role::cells, 4, kTetrahedronCell},
    {"Prisms", 9, Role::cells, 6, kWedgeCell},
    {"Hexahedra", 10, Role::cells, 8, kHexahedronCell},
    {"Hexaedra", 0, Role::cells, 8, kHexahedronCell},
    {"Pyramids", 49, Role::cells, 5, kPyramidCell},
    {"EdgesP2", 25, Role::cells, 3, kEdge3Cell},
    {"TrianglesP2", 24, Role::cells, 6, kTriangle6Cell},
    {"QuadrilateralsQ2", 27, Role::cells, 9, kQuad9Cell},
    {"TetrahedraP2", 30, Role::cells, 10, kTetrahedron10Cell},
    {"PrismsP2", 86, Role::cells, 18, kWedge18Cell},
    {"HexahedraQ2", 33, Role::cells, 27, kHexahedron27Cell},
    {"PyramidsP2", 87, Role::cells, 14},
    {"QuadrilateralsQ3", 88, Role::cells, 16},
    {"QuadrilateralsQ4", 89, Role::cells, 25},
    {"TrianglesP3", 90, Role::cells, 10},
    {"TrianglesP4", 91, Role::cells, 15},
    {"EdgesP3", 92, Role::cells, 4},
    {"EdgesP4", 93, Role::cells, 5},
    {"TetrahedraP3", 96, Role::cells, 20},
    {"TetrahedraP4", 97, Role::cells, 35},
    {"HexahedraQ3", 98, Role::cells, 64},
    {"HexahedraQ4", 99, Role::cells, 125},
    {"PyramidsP3", 100, Role::cells, 30},
    {"PyramidsP4", 101, Role::cells, 55},
    {"PrismsP3", 102, Role::cells, 40},
    {"PrismsP4", 103, Role::cells, 75},
    {"Prisms9", 200, Role::cells, 9},
    {"Hexahedra12", 201, Role::cells, 12},
    {"Quadrilaterals6", 202, Role::cells, 6},
    {"Corners", kCornersCode, Role::kept},
    {"Ridges", 14, Role::kept, 0, 0, "Edges"},
    {"RequiredVertices", kRequiredVerticesCode, Role::kept},
    {"RequiredEdges", 16, Role::kept, 0, 0, "Edges"},
    {"RequiredTriangles", 17, Role::kept, 0, 0, "Triangles"},
    {"RequiredQuadrilaterals", 18, Role::kept, 0, 0, "Quadrilaterals"},
    {"RequiredTetrahedra", 0, Role::kept, 0, 0, "Tetrahedra"},
    {"RequiredPrisms", 0, Role::kept, 0, 0, "Prisms"},
    {"RequiredPyramids", 0, Role::kept, 0, 0, "Pyramids"},
    {"RequiredHexahedra", 0, Role::kept, 0, 0, "Hexahedra"},
    {"ParallelVertices", 0, Role::kept},
    {"ParallelEdges", 0, Role::kept, 0, 0, "Edges"},
    {"ParallelTriangles", 0, Role::kept, 0, 0, "Triangles"},
    {"Polyhedra", 46, Role::refused},
    {"Polygons", 47, Role::refused},
    {"BoundaryPolygonHeaders", 203, Role::refused},
    {"InnerPolygonHeaders", 205, Role::refused},
    {"PolyhedraHeaders", 207, Role::refused},
    // The order of the nodes in elements, other than the usual one.
    {"EdgesP2Ordering", 127, Role::refused},
    {"TrianglesP2Ordering", 129, Role::refused},
    {"QuadrilateralsQ2Ordering", 131, Role::refused},
    {"TetrahedraP2Ordering", 133, Role::refused},
    {"PrismsP2Ordering", 137, Role::refused},
    {"HexahedraQ2Ordering", 139, Role::refused},
    {"EdgesP1Ordering", 141, Role::refused},
    {"TrianglesP1Ordering", 143, Role::refused},
    {"QuadrilateralsQ1Ordering", 145, Role::refused},
    {"TetrahedraP1Ordering", 147, Role::refused},
    {"PyramidsP1Ordering", 149, Role::refused},
    {"PrismsP1Ordering", 151, Role::refused},
    {"HexahedraQ1Ordering", 153, Role::refused},
});

template <class Rule>
const Keyword* find(Rule rule) {
  const auto* found = std::ranges::find_if(kKeywords, rule);
  return found == kKeywords.end() ? nullptr : found;
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

const Keyword* find_keyword(std::string_view name) {
  return find([&](const Keyword& keyword) { return same_word(keyword.name, name); });
}

const Keyword* find_keyword(int code) {
  return find([&](const Keyword& keyword) { return code != 0 && keyword.code == code; });
}

const Keyword* find_section(int vtk_type) {
  return find([&](const Keyword& keyword) {
    return keyword.role == Role::cells && vtk_type != 0 && keyword.vtk_type == vtk_type;
  });
}

}  // namespace meshsmooth::formats::medit

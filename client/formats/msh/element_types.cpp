#include "msh/element_types.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "dataset.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// Gmsh's numbers, of GmshDefines.h.
constexpr int kPolygon = 34;
constexpr int kPolyhedron = 35;
constexpr int kLineBorder = 67;
constexpr int kTriangleBorder = 68;
constexpr int kPolygonBorder = 69;
constexpr int kLineChild = 70;
constexpr int kTrihedron = 140;
constexpr int kTypeCount = 141;

struct RefusedType {
  int number;
  std::string_view name;
  int order;
};

// clang-format off
constexpr auto kRefused = std::to_array<RefusedType>({
    {14, "Pyramid 14", 2}, {20, "Triangle 9", 3}, {21, "Triangle 10", 3}, {22, "Triangle 12", 4},
    {23, "Triangle 15", 4}, {24, "Triangle 15I", 5}, {25, "Triangle 21", 5}, {26, "Line 4", 3},
    {27, "Line 5", 4}, {28, "Line 6", 5}, {29, "Tetrahedron 20", 3}, {30, "Tetrahedron 35", 4},
    {31, "Tetrahedron 56", 5}, {32, "Tetrahedron 22", 4}, {33, "Tetrahedron 28", 5},
    {36, "Quadrilateral 16", 3}, {37, "Quadrilateral 25", 4}, {38, "Quadrilateral 36", 5},
    {39, "Quadrilateral 12", 3}, {40, "Quadrilateral 16I", 4}, {41, "Quadrilateral 20", 5},
    {42, "Triangle 28", 6}, {43, "Triangle 36", 7}, {44, "Triangle 45", 8},
    {45, "Triangle 55", 9}, {46, "Triangle 66", 10}, {47, "Quadrilateral 49", 6},
    {48, "Quadrilateral 64", 7}, {49, "Quadrilateral 81", 8}, {50, "Quadrilateral 100", 9},
    {51, "Quadrilateral 121", 10}, {52, "Triangle 18", 6}, {53, "Triangle 21I", 7},
    {54, "Triangle 24", 8}, {55, "Triangle 27", 9}, {56, "Triangle 30", 10},
    {57, "Quadrilateral 24", 6}, {58, "Quadrilateral 28", 7}, {59, "Quadrilateral 32", 8},
    {60, "Quadrilateral 36I", 9}, {61, "Quadrilateral 40", 10}, {62, "Line 7", 6},
    {63, "Line 8", 7}, {64, "Line 9", 8}, {65, "Line 10", 9}, {66, "Line 11", 10},
    {71, "Tetrahedron 84", 6}, {72, "Tetrahedron 120", 7}, {73, "Tetrahedron 165", 8},
    {74, "Tetrahedron 220", 9}, {75, "Tetrahedron 286", 10}, {79, "Tetrahedron 34", 6},
    {80, "Tetrahedron 40", 7}, {81, "Tetrahedron 46", 8}, {82, "Tetrahedron 52", 9},
    {83, "Tetrahedron 58", 10}, {84, "Line 1", 0}, {85, "Triangle 1", 0},
    {86, "Quadrilateral 1", 0}, {87, "Tetrahedron 1", 0}, {88, "Hexahedron 1", 0},
    {89, "Prism 1", 0}, {90, "Prism 40", 3}, {91, "Prism 75", 4}, {92, "Hexahedron 64", 3},
    {93, "Hexahedron 125", 4}, {94, "Hexahedron 216", 5}, {95, "Hexahedron 343", 6},
    {96, "Hexahedron 512", 7}, {97, "Hexahedron 729", 8}, {98, "Hexahedron 1000", 9},
    {99, "Hexahedron 32", 3}, {100, "Hexahedron 44", 4}, {101, "Hexahedron 56", 5},
    {102, "Hexahedron 68", 6}, {103, "Hexahedron 80", 7}, {104, "Hexahedron 92", 8},
    {105, "Hexahedron 104", 9}, {106, "Prism 126", 5}, {107, "Prism 196", 6},
    {108, "Prism 288", 7}, {109, "Prism 405", 8}, {110, "Prism 550", 9}, {111, "Prism 24", 3},
    {112, "Prism 33", 4}, {113, "Prism 42", 5}, {114, "Prism 51", 6}, {115, "Prism 60", 7},
    {116, "Prism 69", 8}, {117, "Prism 78", 9}, {118, "Pyramid 30", 3}, {119, "Pyramid 55", 4},
    {120, "Pyramid 91", 5}, {121, "Pyramid 140", 6}, {122, "Pyramid 204", 7},
    {123, "Pyramid 285", 8}, {124, "Pyramid 385", 9}, {125, "Pyramid 21", 3},
    {126, "Pyramid 29", 4}, {127, "Pyramid 37", 5}, {128, "Pyramid 45", 6},
    {129, "Pyramid 53", 7}, {130, "Pyramid 61", 8}, {131, "Pyramid 69", 9}, {132, "Pyramid 1", 0},
    {137, "Tetrahedron 16", 3},
});
// clang-format on

std::array<MshElementType, kTypeCount> make_types() {
  std::array<MshElementType, kTypeCount> types;
  for (int type = 0; type < kTypeCount; ++type) {
    const CellKind* kind = find_gmsh_cell(type);
    if (kind == nullptr) continue;
    types[static_cast<std::size_t>(type)] = {kind, 0, {}, kind->dimension, kind->node_count};
  }
  types[kPolygon] = {nullptr, kPolygonCell, {}, 2, 0};
  types[kPolyhedron] = {nullptr, kPolyhedronCell, {}, 3, 0};
  types[kLineBorder] = {nullptr, 0, "Line Border", 1, 2};
  types[kTriangleBorder] = {nullptr, 0, "Triangle Border", 2, 3};
  types[kPolygonBorder] = {nullptr, 0, "Polygon Border", 2, 0};
  types[kLineChild] = {nullptr, 0, "Line Child", 1, 2};
  types[kTrihedron] = {nullptr, 0, "Trihedron 4", 3, 4};
  return types;
}

}  // namespace

const MshElementType& msh_element_type(const std::filesystem::path& path, int type,
                                       std::int64_t element) {
  static const std::array<MshElementType, kTypeCount> types = make_types();
  if (type >= 0 && type < kTypeCount && types[static_cast<std::size_t>(type)].is_known()) {
    return types[static_cast<std::size_t>(type)];
  }
  const auto* refused = std::ranges::find(kRefused, type, &RefusedType::number);
  const std::string what =
      refused == kRefused.end()
          ? "of Gmsh's type " + std::to_string(type)
          : "a \"" + std::string(refused->name) + "\" of order " + std::to_string(refused->order);
  fail("ELEMENT_NOT_SUPPORTED", path,
       "element " + std::to_string(element) + " is " + what + "; " + kSupportedElements);
}

}  // namespace meshsmooth::formats

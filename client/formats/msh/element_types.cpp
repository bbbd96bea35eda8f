#include "msh/element_types.hpp"

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
constexpr int kPointSub = 133;
constexpr int kLineSub = 134;
constexpr int kTriangleSub = 135;
constexpr int kTetrahedronSub = 136;
constexpr int kTrihedron = 140;
constexpr int kTypeCount = 141;

/// What cannot be smoothed: elements of third order and more, of one node, and pyramids with a node
/// in their base. The name ends with the number of nodes.
struct HeldType {
  int number;
  std::string_view name;
};

// clang-format off
constexpr auto kHeld = std::to_array<HeldType>({
    {14, "Pyramid 14"}, {20, "Triangle 9"}, {21, "Triangle 10"}, {22, "Triangle 12"},
    {23, "Triangle 15"}, {24, "Triangle 15I"}, {25, "Triangle 21"}, {26, "Line 4"}, {27, "Line 5"},
    {28, "Line 6"}, {29, "Tetrahedron 20"}, {30, "Tetrahedron 35"}, {31, "Tetrahedron 56"},
    {32, "Tetrahedron 22"}, {33, "Tetrahedron 28"}, {36, "Quadrilateral 16"},
    {37, "Quadrilateral 25"}, {38, "Quadrilateral 36"}, {39, "Quadrilateral 12"},
    {40, "Quadrilateral 16I"}, {41, "Quadrilateral 20"}, {42, "Triangle 28"}, {43, "Triangle 36"},
    {44, "Triangle 45"}, {45, "Triangle 55"}, {46, "Triangle 66"}, {47, "Quadrilateral 49"},
    {48, "Quadrilateral 64"}, {49, "Quadrilateral 81"}, {50, "Quadrilateral 100"},
    {51, "Quadrilateral 121"}, {52, "Triangle 18"}, {53, "Triangle 21I"}, {54, "Triangle 24"},
    {55, "Triangle 27"}, {56, "Triangle 30"}, {57, "Quadrilateral 24"}, {58, "Quadrilateral 28"},
    {59, "Quadrilateral 32"}, {60, "Quadrilateral 36I"}, {61, "Quadrilateral 40"}, {62, "Line 7"},
    {63, "Line 8"}, {64, "Line 9"}, {65, "Line 10"}, {66, "Line 11"}, {71, "Tetrahedron 84"},
    {72, "Tetrahedron 120"}, {73, "Tetrahedron 165"}, {74, "Tetrahedron 220"},
    {75, "Tetrahedron 286"}, {79, "Tetrahedron 34"}, {80, "Tetrahedron 40"}, {81, "Tetrahedron 46"},
    {82, "Tetrahedron 52"}, {83, "Tetrahedron 58"}, {84, "Line 1"}, {85, "Triangle 1"},
    {86, "Quadrilateral 1"}, {87, "Tetrahedron 1"}, {88, "Hexahedron 1"}, {89, "Prism 1"},
    {90, "Prism 40"}, {91, "Prism 75"}, {92, "Hexahedron 64"}, {93, "Hexahedron 125"},
    {94, "Hexahedron 216"}, {95, "Hexahedron 343"}, {96, "Hexahedron 512"}, {97, "Hexahedron 729"},
    {98, "Hexahedron 1000"}, {99, "Hexahedron 32"}, {100, "Hexahedron 44"}, {101, "Hexahedron 56"},
    {102, "Hexahedron 68"}, {103, "Hexahedron 80"}, {104, "Hexahedron 92"}, {105, "Hexahedron 104"},
    {106, "Prism 126"}, {107, "Prism 196"}, {108, "Prism 288"}, {109, "Prism 405"},
    {110, "Prism 550"}, {111, "Prism 24"}, {112, "Prism 33"}, {113, "Prism 42"}, {114, "Prism 51"},
    {115, "Prism 60"}, {116, "Prism 69"}, {117, "Prism 78"}, {118, "Pyramid 30"},
    {119, "Pyramid 55"}, {120, "Pyramid 91"}, {121, "Pyramid 140"}, {122, "Pyramid 204"},
    {123, "Pyramid 285"}, {124, "Pyramid 385"}, {125, "Pyramid 21"}, {126, "Pyramid 29"},
    {127, "Pyramid 37"}, {128, "Pyramid 45"}, {129, "Pyramid 53"}, {130, "Pyramid 61"},
    {131, "Pyramid 69"}, {132, "Pyramid 1"}, {137, "Tetrahedron 16"},
});
// clang-format on

int number_in(std::string_view name) {
  int number = 0;
  for (const char letter : name.substr(name.find(' ') + 1)) {
    if (letter >= '0' && letter <= '9') number = 10 * number + (letter - '0');
  }
  return number;
}

int dimension_of(std::string_view name) {
  if (name.starts_with("Line")) return 1;
  return name.starts_with("Triangle") || name.starts_with("Quadrilateral") ? 2 : 3;
}

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
  types[kPointSub] = {nullptr, 0, "Point Sub", 0, 1};
  types[kLineSub] = {nullptr, 0, "Line Sub", 1, 2};
  types[kTriangleSub] = {nullptr, 0, "Triangle Sub", 2, 3};
  types[kTetrahedronSub] = {nullptr, 0, "Tetrahedron Sub", 3, 4};
  types[kTrihedron] = {nullptr, 0, "Trihedron 4", 3, 4};
  for (const auto& [number, name] : kHeld) {
    types[static_cast<std::size_t>(number)] = {nullptr, 0, name, dimension_of(name),
                                               number_in(name)};
  }
  return types;
}

}  // namespace

const MshElementType& msh_element_type(const std::filesystem::path& path, int type,
                                       std::int64_t element) {
  static const std::array<MshElementType, kTypeCount> types = make_types();
  if (type >= 0 && type < kTypeCount && types[static_cast<std::size_t>(type)].is_known()) {
    return types[static_cast<std::size_t>(type)];
  }
  fail("ELEMENT_NOT_SUPPORTED", path,
       "element " + std::to_string(element) + " is of Gmsh's type " + std::to_string(type) + "; " +
           kSupportedElements);
}

}  // namespace meshsmooth::formats

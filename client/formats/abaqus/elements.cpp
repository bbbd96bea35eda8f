#include "elements.hpp"

#include <array>
#include <cctype>
#include <charconv>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

struct Family {
  std::string_view base;  // letters may follow ("C3D8RH"), digits not ("C3D10")
  AbaqusElement element;
};

constexpr AbaqusElement kLine = {kLineCell, 2};
constexpr AbaqusElement kTriangle = {kTriangleCell, 3};
constexpr AbaqusElement kQuad = {kQuadCell, 4};
constexpr AbaqusElement kTetrahedron = {kTetrahedronCell, 4};
constexpr AbaqusElement kPyramid = {kPyramidCell, 5};
constexpr AbaqusElement kWedge = {kWedgeCell, 6};
constexpr AbaqusElement kHexahedron = {kHexahedronCell, 8};
constexpr AbaqusElement kEdge3 = {kEdge3Cell, 3};
constexpr AbaqusElement kTriangle6 = {kTriangle6Cell, 6};
constexpr AbaqusElement kQuad8 = {kQuad8Cell, 8};
constexpr AbaqusElement kShell3 = {kTriangleCell, 3, true};
constexpr AbaqusElement kShell4 = {kQuadCell, 4, true};
constexpr AbaqusElement kShell6 = {kTriangle6Cell, 6, true};
constexpr AbaqusElement kShell8 = {kQuad8Cell, 8, true};
constexpr AbaqusElement kShell9 = {kQuad9Cell, 9, true};
constexpr AbaqusElement kTetrahedron10 = {kTetrahedron10Cell, 10};
constexpr AbaqusElement kWedge15 = {kWedge15Cell, 15};
constexpr AbaqusElement kHexahedron20 = {kHexahedron20Cell, 20};
constexpr AbaqusElement kNodes = {kPolyVertexCell, 0};

constexpr AbaqusElement kHeld = {kFirstOwnCellType, 0};

constexpr auto kFamilies = std::to_array<Family>({
    // solid: stress, acoustic, heat transfer, coupled, Eulerian, continuum shells
    {"C3D4", kTetrahedron},
    {"AC3D4", kTetrahedron},
    {"DC3D4", kTetrahedron},
    {"Q3D4", kTetrahedron},
    {"EMC3D4", kTetrahedron},
    {"C3D5", kPyramid},
    {"AC3D5", kPyramid},
    {"DC3D5", kPyramid},
    {"C3D6", kWedge},
    {"AC3D6", kWedge},
    {"DC3D6", kWedge},
    {"Q3D6", kWedge},
    {"SC6", kWedge},
    {"C3D8", kHexahedron},
    {"AC3D8", kHexahedron},
    {"DC3D8", kHexahedron},
    {"Q3D8", kHexahedron},
    {"DCC3D8", kHexahedron},
    {"EC3D8", kHexahedron},
    {"EMC3D8", kHexahedron},
    {"SC8", kHexahedron},
    {"CSS8", kHexahedron},
    {"F3D6", kWedge},  // fluid; F3D4 is a tetrahedron in CalculiX and a quad in Abaqus
    {"F3D8", kHexahedron},
    {"FC3D4", kTetrahedron},
    {"FC3D5", kPyramid},
    {"FC3D6", kWedge},
    {"FC3D8", kHexahedron},
    {"C3D10", kTetrahedron10},
    {"AC3D10", kTetrahedron10},
    {"DC3D10", kTetrahedron10},
    {"Q3D10", kTetrahedron10},
    {"C3D15", kWedge15},
    {"AC3D15", kWedge15},
    {"DC3D15", kWedge15},
    {"C3D20", kHexahedron20},
    {"AC3D20", kHexahedron20},
    {"DC3D20", kHexahedron20},
    {"Q3D20", kHexahedron20},
    // plane and axisymmetric
    {"CPS3", kTriangle},
    {"CPE3", kTriangle},
    {"CPEG3", kTriangle},
    {"CAX3", kTriangle},
    {"CGAX3", kTriangle},
    {"AC2D3", kTriangle},
    {"ACAX3", kTriangle},
    {"DC2D3", kTriangle},
    {"DCAX3", kTriangle},
    {"EMC2D3", kTriangle},
    {"CPS4", kQuad},
    {"CPE4", kQuad},
    {"CPEG4", kQuad},
    {"CAX4", kQuad},
    {"CGAX4", kQuad},
    {"AC2D4", kQuad},
    {"ACAX4", kQuad},
    {"DC2D4", kQuad},
    {"DCC2D4", kQuad},
    {"DCAX4", kQuad},
    {"DCCAX4", kQuad},
    {"EMC2D4", kQuad},
    {"CPS6", kTriangle6},
    {"CPE6", kTriangle6},
    {"CPEG6", kTriangle6},
    {"CAX6", kTriangle6},
    {"CGAX6", kTriangle6},
    {"AC2D6", kTriangle6},
    {"ACAX6", kTriangle6},
    {"DC2D6", kTriangle6},
    {"DCAX6", kTriangle6},
    {"CPS8", kQuad8},
    {"CPE8", kQuad8},
    {"CPEG8", kQuad8},
    {"CAX8", kQuad8},
    {"CGAX8", kQuad8},
    {"AC2D8", kQuad8},
    {"ACAX8", kQuad8},
    {"DC2D8", kQuad8},
    {"DCAX8", kQuad8},
    // shells, membranes, surfaces, rigid surfaces
    {"S3", kShell3},
    {"STRI3", kShell3},
    {"DS3", kShell3},
    {"M3D3", kShell3},
    {"R3D3", kShell3},
    {"SFM3D3", kShell3},
    {"S4", kShell4},
    {"DS4", kShell4},
    {"M3D4", kShell4},
    {"R3D4", kShell4},
    {"SFM3D4", kShell4},
    {"S6", kShell6},
    {"STRI65", kShell6},
    {"DS6", kShell6},
    {"M3D6", kShell6},
    {"SFM3D6", kShell6},
    {"S8", kShell8},
    {"DS8", kShell8},
    {"M3D8", kShell8},
    {"SFM3D8", kShell8},
    {"S9", kShell9},
    {"M3D9", kShell9},
    // lines; beams may have one more node for their direction
    {"T2D2", kLine},
    {"T3D2", kLine},
    {"B21", kLine},
    {"B23", kLine},
    {"B31", kLine},
    {"B33", kLine},
    {"PIPE21", kLine},
    {"PIPE31", kLine},
    {"ELBOW31", kLine},
    {"FRAME2D", kLine},
    {"FRAME3D", kLine},
    {"DC1D2", kLine},
    {"AC1D2", kLine},
    {"SAX1", kLine},
    {"DSAX1", kLine},
    {"MAX1", kLine},
    {"MGAX1", kLine},
    {"SFMAX1", kLine},
    {"SFMGAX1", kLine},
    {"RAX2", kLine},
    {"R2D2", kLine},
    {"RB2D2", kLine},
    {"RB3D2", kLine},
    {"T2D3", kEdge3},
    {"T3D3", kEdge3},
    {"B22", kEdge3},
    {"B32", kEdge3},
    {"PIPE22", kEdge3},
    {"PIPE32", kEdge3},
    {"ELBOW32", kEdge3},
    {"DC1D3", kEdge3},
    {"AC1D3", kEdge3},
    {"SAX2", kEdge3},
    {"DSAX2", kEdge3},
    {"MAX2", kEdge3},
    {"MGAX2", kEdge3},
    {"SFMAX2", kEdge3},
    {"SFMGAX2", kEdge3},
    // what hangs on nodes
    {"MASS", kNodes},
    {"ROTARYI", kNodes},
    {"SPRINGA", kNodes},
    {"SPRING1", kNodes},
    {"SPRING2", kNodes},
    {"DASHPOTA", kNodes},
    {"DASHPOT1", kNodes},
    {"DASHPOT2", kNodes},
    {"CONN2D2", kNodes},
    {"CONN3D2", kNodes},
    {"DCOUP2D", kNodes},
    {"DCOUP3D", kNodes},
    {"GAPUNI", kNodes},
    {"GAPCYL", kNodes},
    {"GAPSPHER", kNodes},
    {"JOINTC", kNodes},
    {"JOINT2D", kNodes},
    {"JOINT3D", kNodes},
    {"HEATCAP", kNodes},
});

/// Cohesive, gasket, infinite and hydrostatic fluid elements, whose number of nodes follows:
/// "GK3D12M". With pore pressure ("COH3D8P") the nodes in the middle may be left out.
constexpr auto kCounted = std::to_array<std::string_view>(
    {"COH2D", "COH3D", "COHAX", "GK2D", "GK3D", "GKPS", "GKPE", "GKAX", "CIN3D", "CINPE", "CINPS",
     "CINAX", "ACIN2D", "ACIN3D", "ACINAX", "F2D", "F3D", "FAX"});

AbaqusElement held_element(std::string_view type) {
  constexpr int kMost = 99;
  if (type == "D") return {kFirstOwnCellType, 3};  // of a network, with 0 at its ends
  for (const std::string_view family : kCounted) {
    if (!type.starts_with(family) || type.ends_with('P')) continue;
    const std::string_view digits = type.substr(family.size());
    int count = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), count);
    if (count > 0 && count <= kMost) return {kFirstOwnCellType, count};
  }
  return kHeld;
}

}  // namespace

AbaqusElement find_abaqus_element(std::string_view type) {
  if (type.starts_with("C3D15V")) return kHeld;  // has 15 to 18 nodes
  for (const auto& [base, element] : kFamilies) {
    if (!type.starts_with(base)) continue;
    const bool ends = type.size() == base.size();
    if (ends || std::isdigit(static_cast<unsigned char>(type[base.size()])) == 0) return element;
  }
  return held_element(type);
}

}  // namespace meshsmooth::formats

#include "abaqus_elements.hpp"

#include <array>
#include <cctype>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

struct Family {
  std::string_view base;  // letters may follow ("C3D8RH"), digits not ("C3D10")
  AbaqusElement element;
};

constexpr AbaqusElement kLine = {kLineCell, 2, false};
constexpr AbaqusElement kTriangle = {kTriangleCell, 3, false};
constexpr AbaqusElement kQuad = {kQuadCell, 4, false};
constexpr AbaqusElement kTetrahedron = {kTetrahedronCell, 4, false};
constexpr AbaqusElement kPyramid = {kPyramidCell, 5, false};
constexpr AbaqusElement kWedge = {kWedgeCell, 6, true};
constexpr AbaqusElement kHexahedron = {kHexahedronCell, 8, false};
constexpr AbaqusElement kNodes = {kPolyVertexCell, 0, false};

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
    // shells, membranes, surfaces, rigid surfaces
    {"S3", kTriangle},
    {"STRI3", kTriangle},
    {"DS3", kTriangle},
    {"M3D3", kTriangle},
    {"R3D3", kTriangle},
    {"SFM3D3", kTriangle},
    {"S4", kQuad},
    {"DS4", kQuad},
    {"M3D4", kQuad},
    {"R3D4", kQuad},
    {"SFM3D4", kQuad},
    // lines; beams may have one more node for their direction
    {"T2D2", kLine},
    {"T3D2", kLine},
    {"B21", kLine},
    {"B23", kLine},
    {"B31", kLine},
    {"B33", kLine},
    {"PIPE21", kLine},
    {"PIPE31", kLine},
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

}  // namespace

std::optional<AbaqusElement> find_abaqus_element(std::string_view type) {
  for (const auto& [base, element] : kFamilies) {
    if (!type.starts_with(base)) continue;
    const bool ends = type.size() == base.size();
    if (ends || std::isdigit(static_cast<unsigned char>(type[base.size()])) == 0) return element;
  }
  return std::nullopt;
}

}  // namespace meshsmooth::formats

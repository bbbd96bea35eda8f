#include "nastran/element_cards.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

using Role = NastranElement::Role;

constexpr NastranElement triangle(std::string_view name, std::uint8_t nodes = 3) {
  return {name, Role::mesh, kTriangleCell, nodes == 6 ? kTriangle6Cell : 0, 3, nodes, 2};
}
constexpr NastranElement quad(std::string_view name, std::uint8_t nodes = 4) {
  const int second = nodes == 9 ? kQuad9Cell : nodes == 8 ? kQuad8Cell : 0;
  return {name, Role::mesh, kQuadCell, second, 4, nodes, 2};
}
constexpr NastranElement solid(std::string_view name, int linear, int second, std::uint8_t corners,
                               std::uint8_t nodes) {
  return {name, Role::mesh, linear, second, corners, nodes, 2};
}
constexpr NastranElement held(std::string_view name) { return {name, Role::held, 0, 0, 0, 0, 2}; }
constexpr NastranElement line(std::string_view name, std::string_view fields) {
  return {name, Role::line, kLineCell, 0, 2, 2, 0, fields};
}
constexpr NastranElement points(std::string_view name, std::string_view fields = {}) {
  return {name, Role::points, kPolyVertexCell, 0, 0, 0, 1, fields};
}
constexpr NastranElement no_nodes(std::string_view name) {
  return {name, Role::no_nodes, 0, 0, 0, 0, 0};
}

// Of MSC, NX, OptiStruct and NASTRAN-95.
constexpr auto kCards = std::to_array<NastranElement>({
    triangle("CTRIA3"),
    triangle("CTRIAR"),
    triangle("CTRIA6", 6),
    triangle("CTRIAX", 6),
    triangle("CTRIAX6", 6),
    triangle("CTRAX3"),
    triangle("CPLSTN3"),
    triangle("CPLSTN6", 6),
    triangle("CPLSTS3"),
    triangle("CPLSTS6", 6),
    triangle("CTRIA1"),
    triangle("CTRIA2"),
    triangle("CTRMEM"),
    triangle("CTRBSC"),
    triangle("CTRPLT"),
    quad("CQUAD4"),
    quad("CQUADR"),
    quad("CSHEAR"),
    quad("CTWIST"),
    quad("CQUAD8", 8),
    quad("CQUAD", 9),
    quad("CQUADX", 9),
    quad("CQUAD9", 9),  // Gmsh's
    quad("CQUADX4"),
    quad("CQUADX8", 8),
    quad("CPLSTN4"),
    quad("CPLSTN8", 8),
    quad("CPLSTS4"),
    quad("CPLSTS8", 8),
    quad("CQUAD1"),
    quad("CQUAD2"),
    quad("CQDMEM"),
    quad("CQDMEM1"),
    quad("CQDMEM2"),
    quad("CQDPLT"),
    solid("CTETRA", kTetrahedronCell, kTetrahedron10Cell, 4, 10),
    solid("CPYRAM", kPyramidCell, kPyramid13Cell, 5, 13),
    solid("CPYRA", kPyramidCell, kPyramid13Cell, 5, 13),
    solid("CPENTA", kWedgeCell, kWedge15Cell, 6, 15),
    solid("CHEXA", kHexahedronCell, kHexahedron20Cell, 8, 20),
    solid("CWEDGE", kWedgeCell, 0, 6, 6),
    solid("CHEXA1", kHexahedronCell, 0, 8, 8),
    solid("CHEXA2", kHexahedronCell, 0, 8, 8),
    solid("CIHEX1", kHexahedronCell, 0, 8, 8),
    held("CTRAX6"),
    held("CTRSHL"),
    held("CIHEX2"),
    held("CIHEX3"),
    held("CHEXCZ"),
    held("CPENTCZ"),
    held("CIFHEX"),
    held("CIFPENT"),
    held("CIFQUAD"),
    held("CIFQDX"),
    held("CACINF3"),
    held("CACINF4"),
    held("CRAC2D"),
    held("CRAC3D"),
    line("CBAR", "CD"),
    line("CBEAM", "CD"),
    line("CBEND", "CD"),
    line("CBEAR", "CD"),
    line("CROD", "CD"),
    line("CTUBE", "CD"),
    line("CVISC", "CD"),
    line("CONROD", "BC"),
    line("PLOTEL", "BC"),
    line("RBAR", "BC"),
    line("RROD", "BC"),
    line("RJOINT", "BC"),
    points("CBEAM3", "CDE"),
    points("CGAP", "CD"),
    points("CBUSH", "CD"),
    points("CBUSH1D", "CD"),
    points("CBUSH2D", "CD"),
    points("CELAS1", "CE"),
    points("CELAS2", "CE"),
    points("CELAS3", "CD"),
    points("CELAS4", "CD"),
    points("CDAMP1", "CE"),
    points("CDAMP2", "CE"),
    points("CDAMP3", "CD"),
    points("CDAMP4", "CD"),
    points("CDAMP5", "CD"),
    points("CMASS1", "CE"),
    points("CMASS2", "CE"),
    points("CMASS3", "CD"),
    points("CMASS4", "CD"),
    points("CONM1", "B"),
    points("CONM2", "B"),
    points("CAABSF", "CDEF"),
    points("CHBDYG", "IJKLMNOP"),
    points("CHBDYP", "FGH"),
    points("CWELD"),
    points("CFAST"),
    points("CSEAM"),
    points("CSPR"),
    points("CBUTT"),
    points("CFILLET"),
    points("COMBWLD"),
    points("CCRSFIL"),
    points("RBE1"),
    points("RBE2"),
    points("RBE3"),
    points("RTRPLT", "BCD"),
    points("RTRPLT1", "BCD"),
    points("RSPLINE"),
    no_nodes("CHBDYE"),
    no_nodes("CCONEAX"),
    no_nodes("CAXIF2"),
    no_nodes("CAXIF3"),
    no_nodes("CAXIF4"),
    no_nodes("CFLUID2"),
    no_nodes("CFLUID3"),
    no_nodes("CFLUID4"),
    no_nodes("CSLOT3"),
    no_nodes("CSLOT4"),
});

// What starts so is no element.
constexpr auto kOthers = std::to_array<std::string_view>(
    {"CAERO",  "CAMPBLL", "CAXISYM", "CBARAO", "CEND",    "CGEN",   "CLOAD",    "CMARK",
     "CNGRNT", "COHF",    "COMPUDS", "CONCTL", "CONTRLT", "CONV",   "CORD",     "COUOPT",
     "COUP",   "CREEP",   "CSCHD",   "CSET",   "CSPOT",   "CSSCHD", "CSUP",     "CSUPEXT",
     "CSWPNT", "CYAX",    "CYCADD",  "CYCLIC", "CYCSET",  "CYJOIN", "CYLINDER", "CYLINDR",
     "CYSUP",  "CYSYM",   "CNTRL",   "COSINE", "CONTACT", "CTYPE",  "COMMENT",  "CREF",
     "CASE",   "COHESIV", "COHFRIC", "COHSEIV"});

std::vector<const NastranElement*> sorted_cards() {
  std::vector<const NastranElement*> cards;
  for (const NastranElement& card : kCards) cards.push_back(&card);
  std::ranges::sort(cards, {}, &NastranElement::name);
  return cards;
}

}  // namespace

const NastranElement* find_nastran_element(std::string_view name) {
  static const std::vector<const NastranElement*> cards = sorted_cards();
  const auto found = std::ranges::lower_bound(cards, name, {}, &NastranElement::name);
  return found == cards.end() || (*found)->name != name ? nullptr : *found;
}

bool is_other_nastran_card(std::string_view name) {
  return std::ranges::any_of(kOthers,
                             [&](std::string_view other) { return name.starts_with(other); });
}

}  // namespace meshsmooth::formats

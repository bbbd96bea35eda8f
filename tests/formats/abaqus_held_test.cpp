// Elements of Abaqus and CalculiX decks that cannot be smoothed: they hold their nodes.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A fan of four triangles, whose middle is node 5; nodes 6 to 17 on a line above it.
std::string fan() {
  std::string text = "*NODE\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n5, .4, .6\n";
  for (int node = 6; node <= 35; ++node) text += std::to_string(node) + ", 0, 0, 5\n";
  return text + "*ELEMENT, TYPE=CPS3, ELSET=fan\n1, 1, 2, 5\n2, 2, 3, 5\n3, 3, 4, 5\n4, 4, 1, 5\n";
}

std::vector<std::string> held(const MeshFile& file) {
  std::vector<std::string> counts;
  for (const HeldCells& cells : file.held_cells()) {
    counts.push_back(cells.name + " " + std::to_string(cells.count));
  }
  return counts;
}

std::vector<std::int64_t> fixed(const MeshFile& file) {
  std::vector<std::int64_t> ids;
  for (std::size_t node = 0; node < file.mesh.fixed.size(); ++node) {
    if (file.mesh.fixed[node] != 0) {
      ids.push_back(file.file_node_id(static_cast<std::int64_t>(node)));
    }
  }
  return ids;
}

class AbaqusHeld : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.inp"), text);
    return read_mesh_file(scratch_.path("in.inp"));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }

  const Scratch scratch_;
};

TEST_F(AbaqusHeld, HoldsNetworkElementsWithoutTheirOpenEnds) {
  const MeshFile file = read(fan() + "*ELEMENT, TYPE=D, ELSET=gas\n10, 0, 6, 5\n11, 5, 7, 0\t\n");

  EXPECT_EQ(file.mesh.element_count(), 4U);
  EXPECT_THAT(held(file), ElementsAre("D 2"));
  EXPECT_THAT(fixed(file), ElementsAre(5, 6, 7));
  EXPECT_THAT(find_node_set(file, "gas"), ElementsAre(4, 5, 6));
  EXPECT_THAT(file.notes(), IsEmpty());
}

TEST_F(AbaqusHeld, WritesADeckWithHeldElementsBackByteForByte) {
  const std::string text = fan() + "*USER ELEMENT, TYPE=U1, NODES=2\n*ELEMENT, TYPE=U1\n9, 6, 7\n";
  MeshFile file = read(text);
  positions_of(file)[4] = {0.5, 0.5, 0};
  write_mesh_file(scratch_.path("out.inp"), file);

  EXPECT_THAT(changed_lines(text, bytes_of(scratch_.path("out.inp"))), ElementsAre("5, 0.5, 0.5"));
  EXPECT_THAT(held(read_mesh_file(scratch_.path("out.inp"))), ElementsAre("U1 1"));
}

TEST_F(AbaqusHeld, CountsTheNodesOfEveryType) {
  const struct {
    std::string elements;
    std::string counts;
    std::vector<std::int64_t> nodes;
  } decks[] = {
      {"*USER ELEMENT, TYPE=US3, NODES=3, MAXDOF=6\n*ELEMENT, TYPE=US3\n9, 6, 7\n8\n10, 9, 10, "
       "11\n",
       "US3 2",
       {6, 7, 8, 9, 10, 11}},
      {"*ELEMENT, TYPE=U7\n9, 6, 7, 8,\n9, 10\n10, 11, 12, 13, 14, 15\n",
       "U7 2",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15}},
      {"*ELEMENT, TYPE=COH3D6\n9, 6, 7, 8, 9, 10, 11,\n10, 12, 13, 14, 15, 16, 17,\n",
       "COH3D6 2",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17}},
      {"*ELEMENT, TYPE=COH2D4\n9, 6, 7,\n8, 9\n", "COH2D4 1", {6, 7, 8, 9}},
      {"*ELEMENT, TYPE=COH3D8P\n9, 6, 7, 8, 9, 10, 11, 12, 13\n10, 14, 15, 16, 17, 18, 19, 20, 21, "
       "22, 23, 24, 25\n",
       "COH3D8P 2",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25}},
      {"*ELEMENT, TYPE=GK3D12M\n9, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17\n",
       "GK3D12M 1",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17}},
      {"*ELEMENT, TYPE=CINPE5R\n9, 6, 7, 8, 9, 10\n", "CINPE5R 1", {6, 7, 8, 9, 10}},
      {"*ELEMENT, TYPE=CIN3D8\n9, 6, 7, 8, 9, 10, 11, 12, 13\n",
       "CIN3D8 1",
       {6, 7, 8, 9, 10, 11, 12, 13}},
      {"*ELEMENT, TYPE=F3D4\n9, 6, 7, 8, 9\n", "F3D4 1", {6, 7, 8, 9}},
      {"*ELEMENT, TYPE=C3D15V\n9, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20,\n21, 22\n"
       "10, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20\n",
       "C3D15V 2",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22}},
      {"*ELEMENT, TYPE=C3D27\n9, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20,\n"
       "21, 22, 23, 24, 25, 26, 27, , , , , , 33\n",
       "C3D27 1",
       {6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 33}},
      {"*element, type=not of this world\n9, 6\n10, 7, 8\n", "NOT OF THIS WORLD 2", {6, 7, 8}},
  };
  for (const auto& [elements, counts, nodes] : decks) {
    const MeshFile file = read(fan() + elements);
    EXPECT_THAT(held(file), ElementsAre(counts)) << elements;
    EXPECT_EQ(fixed(file), nodes) << elements;
    EXPECT_EQ(file.mesh.element_count(), 4U) << elements;
  }
}

TEST_F(AbaqusHeld, FluidElementsAreElements) {
  const std::string cube =
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n";
  for (const std::string type : {"F3D8", "FC3D8", "F3D8R"}) {
    const MeshFile file = read(cube + "*ELEMENT, TYPE=" + type + "\n1,1,2,3,4,5,6,7,8\n");
    EXPECT_EQ(file.mesh.blocks.at(0).type, ElementType::hexahedron) << type;
  }
}

TEST_F(AbaqusHeld, KeepsTheNodesOfANetworkThatHaveNoPlace) {
  const MeshFile file = read(fan() + "*ELEMENT, TYPE=D\n10, 5, 99, 6\n11, 6, 98, 0\n");

  EXPECT_THAT(fixed(file), ElementsAre(5, 6));
  EXPECT_THAT(file.notes(),
              ElementsAre("line 43: element 10 uses node 99, which is not there (and 1 more)"));
}

TEST_F(AbaqusHeld, ANetworkAloneIsNoMesh) {
  const auto [reason, text] =
      error("*NODE\n1, 0, 0\n2, 1, 0\n3, 1, 1\n*ELEMENT, TYPE=D\n7, 1, 2, 3\n8, 0, 3, 1\n");
  EXPECT_EQ(reason, "MESH_EMPTY");
  EXPECT_THAT(text, HasSubstr("no surface or volume elements in it, only 2 of the type D"));
}

TEST_F(AbaqusHeld, EveryLineMayEndWithAComma) {
  const MeshFile file = read(fan() + "*ELEMENT, TYPE=UX\n9, 6, 7,\n10, 8, 9,\n11, 10, 11,\n");
  EXPECT_THAT(held(file), ElementsAre("UX 3"));
  EXPECT_THAT(fixed(file), ElementsAre(6, 7, 8, 9, 10, 11));
}

TEST_F(AbaqusHeld, SaysWhatIsWrongWithAnElementAndWhere) {
  const struct {
    std::string elements;
    std::string reason;
    std::string what;
  } decks[] = {
      {"*ELEMENT, TYPE=UX\n9, 6, 7,\n10, 8,\n", "FORMAT_ERROR",
       "line 44: every line of the elements of the type UX ends with a comma"},
      {"*ELEMENT, TYPE=UX\n9, 6, 7\n10\n", "FORMAT_ERROR",
       "line 44: expected the nodes of element"},
      {"*ELEMENT, TYPE=UX\n9, x\n", "FORMAT_ERROR",
       "line 43: expected a number above 0, found \"x"},
      {"*ELEMENT, TYPE=UX\n0, 6\n", "FORMAT_ERROR",
       "line 43: expected a number above 0, found \"0"},
      {"*ELEMENT, TYPE=UX\n1, 6\n", "FORMAT_ERROR",
       "line 43: expected each element once, found 1 again, which is in line 38"},
      {"*ELEMENT, TYPE=COH3D8\n9, 6, 7, 8\n", "FILE_TRUNCATED", "element 9 has 3 of its 8 nodes"},
      {"*ELEMENT, TYPE=D\n9, 0, 0, 0\n", "FORMAT_ERROR", "line 43: expected the nodes"},
      {"*USER ELEMENT, TYPE=U1\n", "FORMAT_ERROR", "line 42: expected TYPE= and NODES="},
      {"*USER ELEMENT, TYPE=U1, NODES=two\n", "FORMAT_ERROR", "line 42: expected TYPE= and NODES="},
      {"*ELEMENT, TYPE=U1\n9, 6, 7\n*USER ELEMENT, TYPE=U1, NODES=3\n", "FORMAT_ERROR",
       "line 44: an element of the type U1 before this line has 2 nodes, not 3"},
  };
  for (const auto& [elements, reason, what] : decks) {
    const auto [found, message] = error(fan() + elements);
    EXPECT_EQ(found, reason) << elements;
    EXPECT_THAT(message, HasSubstr(what)) << elements;
  }
}

}  // namespace
}  // namespace meshsmooth::formats

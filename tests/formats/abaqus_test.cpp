// Abaqus and CalculiX decks.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::fixture;
using test::ids_of_set;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;

class Abaqus : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text, const std::string& name = "in.inp") const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file,
                                    const std::string& name = "out.inp") const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }

  const Scratch scratch_;
};

const std::string kTetrahedron =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
    "*ELEMENT, TYPE=C3D4, ELSET=all\n10, 1, 2, 3, 4\n";

TEST_F(Abaqus, ReadsAWholeDeck) {
  const MeshFile file = read_mesh_file(fixture("deck.inp"));

  EXPECT_EQ(file.mesh.node_count(), 13U);
  ASSERT_EQ(file.mesh.blocks.size(), 3U);
  EXPECT_EQ(file.mesh.blocks[0].type, ElementType::hexahedron);
  EXPECT_EQ(file.mesh.blocks[1].type, ElementType::wedge);
  EXPECT_EQ(file.mesh.blocks[2].type, ElementType::pyramid);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2) << "a beam and a mass";
  EXPECT_EQ(file.file_element_id(0), 10);
  EXPECT_EQ(file.file_node_id(12), 113);
  EXPECT_EQ(ids_of_set(file, "bottom"), (std::vector<std::int64_t>{101, 102, 103, 104}));
  EXPECT_EQ(ids_of_set(file, "odd"), (std::vector<std::int64_t>{101, 103, 105, 107}));
  EXPECT_EQ(ids_of_set(file, "bottom and odd"),
            (std::vector<std::int64_t>{101, 102, 103, 104, 105, 107, 113}));
  EXPECT_EQ(ids_of_set(file, "Tip"), (std::vector<std::int64_t>{105, 106, 107, 108, 113}));
  EXPECT_EQ(ids_of_set(file, "of_block"),
            (std::vector<std::int64_t>{101, 102, 103, 104, 105, 106, 107, 108}));
  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "abaqus:material");
  EXPECT_THAT(regions.of_element, ElementsAre(0, 1, 0)) << "steel, rubber, steel";
}

TEST_F(Abaqus, ReadsEveryFormOfACoordinate) {
  const MeshFile file = read(
      " *node\n 1, -1.5D+1,2.5d0 , .5\n2,, 1\n3, 1e2,\n4,+1.,-2.E-1, 3.\r\n"
      "*element, type=c3d4\n1,1,2,3,4\n");

  const auto& nodes = std::get<std::vector<Vec3d>>(file.mesh.positions);
  EXPECT_EQ(nodes[0], (Vec3d{-15, 2.5, 0.5}));
  EXPECT_EQ(nodes[1], (Vec3d{0, 1, 0}));
  EXPECT_EQ(nodes[2], (Vec3d{100, 0, 0}));
  EXPECT_EQ(nodes[3], (Vec3d{1, -0.2, 3}));
}

TEST_F(Abaqus, TurnsAWedgeToVtksOrder) {
  const MeshFile file = read(
      "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n6,0,1,1\n"
      "*ELEMENT, TYPE=C3D6\n1, 1,2,3,4,5,6\n");

  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 2, 1, 3, 5, 4));
}

TEST_F(Abaqus, KeepsEveryByteWhereNothingMoved) {
  const std::string text = bytes_of(fixture("deck.inp"));

  EXPECT_EQ(written(read_mesh_file(fixture("deck.inp"))), text);
  EXPECT_EQ(written(read(text + "*END STEP")), text + "*END STEP") << "no newline at the end";
}

TEST_F(Abaqus, ChangesCoordinatesAlone) {
  MeshFile file = read_mesh_file(fixture("deck.inp"));
  positions_of(file)[0].x = -0.25;
  positions_of(file)[1].y = 1.0 / 3;
  positions_of(file)[12].z = 2.5;

  EXPECT_THAT(changed_lines(bytes_of(fixture("deck.inp")), written(file)),
              ElementsAre("   101,      -0.25D0,           0.,           0.",
                          "   102,           1., 0.3333333333333333,           0.",
                          "113, .5, .5,2.5, 0., 0., 1."));
}

TEST_F(Abaqus, FillsInCoordinatesThatWereLeftOut) {
  MeshFile file = read("*NODE\n1\n2, 1\n3, 0., 1.,\n4,,,1.\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n");
  positions_of(file) = {{0, 0, 7}, {1, 5, 6}, {0, 1, 0.5}, {2, 0, 1}};

  EXPECT_EQ(written(file),
            "*NODE\n1,,,7.\n2, 1,5.,6.\n3, 0., 1.,0.5\n4,2.,,1.\n"
            "*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n");
}

TEST_F(Abaqus, AZeroThatWasLeftOutStaysSoWithAnySign) {
  MeshFile file = read("*NODE\n1, 0., 0.\n2, 1., 0.\n3, 0., 1.\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n");
  positions_of(file)[1] = {1.5, -0.0, -0.0};

  EXPECT_EQ(written(file),
            "*NODE\n1, 0., 0.\n2, 1.5, 0.\n3, 0., 1.\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n");
}

TEST_F(Abaqus, WritesNoNumberOfMoreThanTwentyCharacters) {
  MeshFile file = read(kTetrahedron);
  const std::vector<Vec3d> moved = {{-1.2345678901234567e-5, 1.2345678901234567e-300, -1.0 / 3},
                                    {-123456789.12345678, 1e300, 5e-324},
                                    {-2.0 / 3 * 1e-3, 1e21, 123456},
                                    {1e-5, -1e-5, -1.7976931348623157e308}};
  positions_of(file) = moved;

  std::vector<std::string_view> words;
  const std::string text = written(file);
  for (const std::string& line : test::lines_of(text)) {
    std::istringstream stream(line);
    for (std::string word; std::getline(stream, word, ',');) {
      EXPECT_LE(word.size(), 21U) << line << ": a blank and the number";
    }
  }
  MeshFile after = read(text);
  for (std::size_t node = 0; node < moved.size(); ++node) {
    const Vec3d read = positions_of(after)[node];
    EXPECT_NEAR(read.x, moved[node].x, 1e-12 * std::abs(moved[node].x));
    EXPECT_NEAR(read.y, moved[node].y, 1e-12 * std::abs(moved[node].y));
    EXPECT_NEAR(read.z, moved[node].z, 1e-12 * std::abs(moved[node].z));
  }
  EXPECT_EQ(positions_of(after)[0].z, -1.0 / 3) << "what fits keeps all its digits";
}

// --- files that include others ------------------------------------------------------

TEST_F(Abaqus, WrittenElsewhereADeckNeedsNoOtherFile) {
  put_bytes(scratch_.path("nodes.inp"), "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1");
  put_bytes(scratch_.path("more.dat"), "11, 1, 2, 3, 4\n");
  MeshFile file =
      read("*Include,\n input=nodes.inp\n*ELEMENT, INPUT=more.dat, TYPE=C3D4\n10, 1, 2, 3, 4\n");
  EXPECT_EQ(file.file_element_id(0), 11);
  positions_of(file)[3].z = 2;

  EXPECT_EQ(written(file),
            "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 2.\n"
            "*ELEMENT, TYPE=C3D4\n11, 1, 2, 3, 4\n10, 1, 2, 3, 4\n");
  EXPECT_THAT(bytes_of(scratch_.path("nodes.inp")), HasSubstr("4, 0, 0, 1"));
}

TEST_F(Abaqus, WrittenOverItselfADeckChangesWhereItsNodesStand) {
  std::filesystem::create_directory(scratch_.path("mesh"));
  put_bytes(scratch_.path("mesh/all.inp"), "*INCLUDE, INPUT=nodes.inp\n*INCLUDE,INPUT=cells.inp\n");
  put_bytes(scratch_.path("mesh/nodes.inp"), "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n");
  put_bytes(scratch_.path("mesh/cells.inp"), "*ELEMENT, TYPE=C3D4\n10, 1, 2, 3, 4\n");
  const std::string main = "*INCLUDE, INPUT=mesh/all.inp\n*NODE\n4, 0, 0, 1\n";
  MeshFile file = read(main);
  positions_of(file)[1].x = 3;
  positions_of(file)[3].z = 2;

  EXPECT_EQ(written(file, "in.inp"), "*INCLUDE, INPUT=mesh/all.inp\n*NODE\n4, 0, 0, 2.\n");

  EXPECT_EQ(bytes_of(scratch_.path("mesh/nodes.inp")),
            "*NODE\n1, 0, 0, 0\n2, 3., 0, 0\n3, 0, 1, 0\n");
  MeshFile after = read_mesh_file(scratch_.path("in.inp"));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
}

TEST_F(Abaqus, RefusesIncludesThatCannotBe) {
  EXPECT_THAT(error("*INCLUDE, INPUT=none.inp\n").second,
              HasSubstr("in.inp: line 1: there is no file \""));
  EXPECT_EQ(error("*INCLUDE, INPUT=none.inp\n").first, "FILE_NOT_FOUND");
  EXPECT_THAT(error("*INCLUDE\n").second, HasSubstr("INPUT="));
  EXPECT_THAT(error("*INCLUDE, INPUT=in.inp\n").second, HasSubstr("does not include itself"));
  put_bytes(scratch_.path("bad.inp"), "*NODE\n1, zero\n");
  EXPECT_THAT(error("*HEADING\n*INCLUDE, INPUT=bad.inp\n").second,
              HasSubstr("bad.inp: line 2: expected a number"));
  put_bytes(scratch_.path("twice.inp"), "1, 0., 0., 0.\n");
  EXPECT_THAT(error("*PART, NAME=A\n*NODE, INPUT=twice.inp\n*END PART\n"
                    "*PART, NAME=B\n*NODE, INPUT=twice.inp\n*END PART\n")
                  .second,
              HasSubstr("twice.inp: line 1: expected no nodes in a file that is included twice"));
}

TEST_F(Abaqus, ACommaInQuotesSeparatesNothing) {
  put_bytes(scratch_.path("a, b.inp"), "*NODE\n5, 2, 2, 2\n");
  const MeshFile file = read(kTetrahedron +
                             "*INCLUDE, INPUT=\"a, b.inp\"\n"
                             "*NSET, NSET=\"picked set, 4\", GENERATE\n1, 3, 2\n"
                             "*NSET, NSET=more\n\"picked set, 4\", 5\n"
                             "*NSET, NSET=\"open\n2\n");

  EXPECT_EQ(ids_of_set(file, "picked set, 4"), (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(ids_of_set(file, "more"), (std::vector<std::int64_t>{1, 3, 5}));
  EXPECT_EQ(ids_of_set(file, "\"open"), (std::vector<std::int64_t>{2}));
}

// --- parts --------------------------------------------------------------------------

TEST_F(Abaqus, ReadsEachPartOnce) {
  MeshFile file = read_mesh_file(fixture("parts.inp"));

  EXPECT_EQ(file.mesh.node_count(), 9U) << "two parts and a reference point";
  EXPECT_EQ(file.mesh.element_count(), 2U);
  EXPECT_EQ(file.file_node_id(4), 4) << "labels come twice: they count from 0";
  EXPECT_THAT(find_node_set(file, "base"), ElementsAre(0, 1, 2, 4, 5, 6)) << "of both parts";
  EXPECT_THAT(find_node_set(file, "Block-1.base"), ElementsAre(0, 1, 2));
  EXPECT_THAT(find_node_set(file, "Block-2.base"), ElementsAre(0, 1, 2)) << "the same nodes";
  EXPECT_THAT(find_node_set(file, "Lid-1.base"), ElementsAre(4, 5, 6));
  EXPECT_THAT(find_node_set(file, "tips"), ElementsAre(3, 4, 5, 6, 7));
  EXPECT_THAT(find_node_set(file, "lid"), ElementsAre(4, 5, 6, 7));
  EXPECT_THAT(find_node_set(file, "wire"), ElementsAre(3, 4)) << "of two instances";
  EXPECT_THAT(find_node_set(file, "weight"), ElementsAre(8)) << "the assembly's own node";
  EXPECT_EQ(find_regions(file).count, 2U);

  positions_of(file)[7].z = 5;
  EXPECT_THAT(changed_lines(bytes_of(fixture("parts.inp")), written(file)),
              ElementsAre("4, 0., 0., 5."));
}

TEST_F(Abaqus, AnInstanceMayHoldTheMesh) {
  const MeshFile file = read(
      "*PART, NAME=P\n*END PART\n*ASSEMBLY, NAME=A\n"
      "*INSTANCE, NAME=P-1, PART=P\n" +
      kTetrahedron +
      "*END INSTANCE\n*NSET, NSET=s, INSTANCE=P-1\n3\n"
      "*END ASSEMBLY\n");

  EXPECT_THAT(find_node_set(file, "s"), ElementsAre(2));
  EXPECT_THAT(find_node_set(file, "P-1.all"), ElementsAre(0, 1, 2, 3));
}

// --- what is wrong with a deck ------------------------------------------------------

struct BadDeck {
  std::string text;
  std::string reason;
  std::string what;
};

TEST_F(Abaqus, SaysWhatIsWrongWithADeckAndWhere) {
  const BadDeck decks[] = {
      {"1 0 0 0\n", "FORMAT_ERROR", "line 1: expected a keyword"},
      {"*HEADING\n", "MESH_EMPTY", "no nodes"},
      {"*NODE\n1, 0, 0, 0\n", "MESH_EMPTY", "no surface or volume elements"},
      {"*NODE\n1, a, 0, 0\n", "FORMAT_ERROR", "line 2: expected a number, found \"a\""},
      {"*NODE\n\n**\n1, <x>, 0, 0\n", "FORMAT_ERROR", "line 4: expected a number"},
      {"*NODE\nx, 0, 0, 0\n", "FORMAT_ERROR", "line 2: expected a number above 0, found \"x\""},
      {"*NODE\n0, 0, 0, 0\n", "FORMAT_ERROR", "expected a number above 0"},
      {"*NODE, SYSTEM=C\n1, 0\n", "FORMAT_ERROR", "rectangular coordinates, found SYSTEM=C"},
      {"*SYSTEM\n1, 0, 0\n*NODE\n1, 0\n", "FORMAT_ERROR", "line 4: expected nodes in the global"},
      {"*NGEN, NSET=a\n1, 11\n", "FORMAT_ERROR", "line 1: *NGEN makes nodes or elements"},
      {kTetrahedron + "10, 1, 2, 3, 4\n", "FORMAT_ERROR",
       "line 8: expected each element once, found 10 again, which is in line 7"},
      {kTetrahedron + "11, 1, 2, 3, 5\n", "FORMAT_ERROR",
       "line 8: element 11 uses node 5, which is not there"},
      {kTetrahedron + "11, 1, 2, 3,\n", "FILE_TRUNCATED",
       "line 8: the deck ends where element 11 has 3 of its 4 nodes"},
      {kTetrahedron + "11, 1, 2, 3\n*NSET, NSET=a\n1\n", "FORMAT_ERROR",
       "line 8: element 11 has 3 of its 4 nodes"},
      {kTetrahedron + "*ELEMENT\n11, 1, 2\n", "FORMAT_ERROR", "line 8: expected TYPE="},
      {kTetrahedron + "*ELEMENT, TYPE=MASS\n12\n", "FORMAT_ERROR", "the nodes of an element"},
      {kTetrahedron + "*NSET\n1\n", "FORMAT_ERROR", "line 8: expected the name of the set"},
      {kTetrahedron + "*NSET, NSET=a\nb\n", "FORMAT_ERROR",
       "line 9: there is no set of nodes \"b\""},
      {kTetrahedron + "*NSET, NSET=a\nb\n*NSET, NSET=b\na\n", "FORMAT_ERROR", "in itself"},
      {kTetrahedron + "*NSET, NSET=a, GENERATE\n4, 1\n", "FORMAT_ERROR", "first, last and step"},
      {kTetrahedron + "*NSET, NSET=a, GENERATE\n1, 4, 0\n", "FORMAT_ERROR", "above 0"},
      {kTetrahedron + "*NSET, NSET=a, INSTANCE=i\n1\n", "FORMAT_ERROR", "no instance \"i\""},
      {"*PART, NAME=A\n" + kTetrahedron, "FILE_TRUNCATED", "*END PART"},
      {"*PART, NAME=A\n*PART, NAME=B\n", "FORMAT_ERROR", "line 2: expected *END PART"},
      {"*PART, NAME=A\n*END PART\n*PART, NAME=a\n", "FORMAT_ERROR", "each part once"},
      {"*INSTANCE, NAME=i, PART=p\n", "FORMAT_ERROR", "there is no part \"p\""},
      {"*PART, NAME=P\n" + kTetrahedron +
           "*END PART\n*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n"
           "*ELEMENT, TYPE=SPRINGA\n1, I.1, I.5\n",
       "FORMAT_ERROR", "line 13: expected a node of the instance, found \"I.5\""},
      {"*NODE,\n", "FILE_TRUNCATED", "line 1: the file ends inside of this keyword"},
      {std::string("*NODE\n1, 0\n\0", 12), "FORMAT_ERROR", "not a text file"},
  };
  for (const auto& [text, reason, what] : decks) {
    const auto [found, message] = error(text);
    EXPECT_EQ(found, reason) << text;
    EXPECT_THAT(message, HasSubstr(what)) << text;
    EXPECT_THAT(message, HasSubstr("in.inp: ")) << text;
  }
}

TEST_F(Abaqus, ARangeOfLabelsMayBeLongerThanTheMesh) {
  const MeshFile file = read(kTetrahedron +
                             "*NSET, NSET=a, GENERATE\n2, 9223372036854775807, 2\n"
                             "*NSET, NSET=b, GENERATE\n3, 5\n");

  EXPECT_EQ(ids_of_set(file, "a"), (std::vector<std::int64_t>{2, 4}));
  EXPECT_EQ(ids_of_set(file, "b"), (std::vector<std::int64_t>{3, 4}));
}

// The keywords of the results are no nodes.
TEST_F(Abaqus, PassesOverWhatIsNotTheMesh) {
  const MeshFile file = read(kTetrahedron +
                             "*STEP\n*NODE PRINT, NSET=all\nU\n*NODE FILE\nU\n"
                             "*EL FILE\nS\n*ELEMENT OUTPUT\nS\n*END STEP\n");
  EXPECT_EQ(file.mesh.node_count(), 4U);
}

}  // namespace
}  // namespace meshsmooth::formats

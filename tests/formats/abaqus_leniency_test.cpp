// What CalculiX and Abaqus read although it is not as the manual has it, and what is no deck.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::ids_of_set;
using test::pairs_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kTetrahedron =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
    "*ELEMENT, TYPE=C3D4, ELSET=all\n10, 1, 2, 3, 4\n";

class AbaqusLeniency : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.inp"), text);
    return read_mesh_file(scratch_.path("in.inp"));
  }
  [[nodiscard]] std::string written(const MeshFile& file,
                                    const std::string& name = "out.inp") const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }

  const Scratch scratch_;
};

TEST_F(AbaqusLeniency, IgnoresNumbersAfterTheLastNode) {
  const MeshFile file = read(kTetrahedron + "11, 2, 3, 4,\n1, 7, 8\n12, 1, 3, 2, 4, 0\n");

  EXPECT_EQ(file.mesh.element_count(), 3U);
  EXPECT_THAT(file.notes(), ElementsAre("line 9: what follows the 4 nodes of element 11 is "
                                        "ignored, as CalculiX does (and 1 more)"));
}

TEST_F(AbaqusLeniency, LeavesOutOfSetsWhatIsNotThere) {
  const MeshFile file = read(kTetrahedron +
                             "*NSET, NSET=a\n1, 99, 3\n*ELSET, ELSET=e\n10, 11\n"
                             "*SOLID SECTION, ELSET=other, MATERIAL=m\n");

  EXPECT_EQ(ids_of_set(file, "a"), (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(ids_of_set(file, "e"), (std::vector<std::int64_t>{1, 2, 3, 4}));
  EXPECT_THAT(file.notes(),
              ElementsAre("line 9: there is no node 99 for this set (and 1 more)",
                          "line 12: there is no set of elements \"other\" for this section"));
}

TEST_F(AbaqusLeniency, NodesOfEquationsArePairs) {
  const MeshFile file = read(kTetrahedron +
                             "5, 1, 2, 3, 4\n*NSET, NSET=a\n3\n*EQUATION\n3\n1, 1, 1., 2, 1, -1.\n"
                             "99, 1, 1.\n2\na, 2, 1.,\n1, 2, -1.\n*STEP\n");

  EXPECT_EQ(pairs_of(file), (std::set<std::set<std::int64_t>>{{1, 2}, {1, 3}}));
  EXPECT_TRUE(file.mesh.fixed.empty());
}

TEST_F(AbaqusLeniency, EquationsOfSetsTieTheirNodesInOrder) {
  const std::string sets = "*NSET, NSET=a\n1, 2\n*NSET, NSET=b\n3, 4\n*NODE\n50, 9, 9, 9\n";
  // A control node in no element belongs to no mesh; one of the mesh is tied to all.
  const MeshFile file =
      read(kTetrahedron + sets + "*EQUATION\n3\na, 1, 1., b, 1, -1., 50, 1, 1.\n");
  EXPECT_EQ(pairs_of(file), (std::set<std::set<std::int64_t>>{{1, 3}, {2, 4}}));
  const MeshFile tied = read(kTetrahedron + sets + "*EQUATION\n2\na, 1, 1., 4, 1, -1.\n");
  EXPECT_EQ(pairs_of(tied), (std::set<std::set<std::int64_t>>{{1, 4}, {2, 4}}));
}

TEST_F(AbaqusLeniency, IgnoresLinesBeforeTheFirstKeyword) {
  const std::string text = "bar under tension\n1 2 3 4 5\n" + kTetrahedron;
  const MeshFile file = read(text);

  EXPECT_EQ(written(file), text);
  EXPECT_THAT(file.notes(), ElementsAre("line 1: what stands before the first keyword is ignored"));
}

TEST_F(AbaqusLeniency, TheLastDefinitionOfANodeCounts) {
  const std::string text = kTetrahedron +
                           "*NODE, NSET=again\n2, 3, 0, 0\n5, 7, 7, 7\n"
                           "*NODE\n2, 2, 0, 0\n";
  MeshFile file = read(text);

  ASSERT_EQ(file.mesh.node_count(), 5U);
  EXPECT_EQ(positions_of(file)[1], (Vec3d{2, 0, 0}));
  EXPECT_EQ(positions_of(file)[4], (Vec3d{7, 7, 7}));
  EXPECT_EQ(ids_of_set(file, "again"), (std::vector<std::int64_t>{2, 5}));
  EXPECT_THAT(file.notes(), ElementsAre("line 9: node 2 is defined again; its last definition "
                                        "counts (and 1 more)"));
  EXPECT_EQ(written(file), text);

  positions_of(file)[1].x = 2.5;
  positions_of(file)[4].z = 8;
  EXPECT_THAT(changed_lines(text, written(file)), ElementsAre("5, 7, 7, 8.", "2, 2.5, 0, 0"));
}

TEST_F(AbaqusLeniency, TheLastDefinitionMayBeInAnotherFile) {
  put_bytes(scratch_.path("more.inp"), "*NODE\n4, 0, 0, 2\n");
  MeshFile file = read(kTetrahedron + "*INCLUDE, INPUT=more.inp\n");
  EXPECT_EQ(positions_of(file)[3].z, 2);
  positions_of(file)[3].z = 3;

  EXPECT_EQ(written(file, "in.inp"), kTetrahedron + "*INCLUDE, INPUT=more.inp\n");
  EXPECT_EQ(bytes_of(scratch_.path("more.inp")), "*NODE\n4, 0, 0, 3.\n");
}

TEST_F(AbaqusLeniency, KeepsAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  const std::string text = mark + kTetrahedron;
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  EXPECT_THAT(file.notes(), IsEmpty());

  put_bytes(scratch_.path("nodes.inp"), mark + "*NODE\n5, 1, 1, 1\n");
  const std::string main = text + "*INCLUDE, INPUT=nodes.inp\n";
  file = read(main);
  positions_of(file)[4].x = 2;
  EXPECT_EQ(written(file), text + "*NODE\n5, 2., 1, 1\n") << "one mark, at the start";
  EXPECT_EQ(written(file, "in.inp"), main);
  EXPECT_EQ(bytes_of(scratch_.path("nodes.inp")), mark + "*NODE\n5, 2., 1, 1\n");
}

TEST_F(AbaqusLeniency, ReadsKeywordsAndDataOfEveryHabit) {
  const std::string text =
      "** a comment\n* HEADING\n long " + std::string(200, 'x') +
      "\n\t* node ,\n1,\t0,0,0,\n2 , 1, 0 ,0\n**\n3,0,1,0\n\n4,0,0,1\n"
      "* Element ,\tType = c3d4 ,\n**\n  elset = \"All of it\"\n10,\t1,2,\n3,4\n";
  const MeshFile file = read(text);

  EXPECT_EQ(file.mesh.node_count(), 4U);
  EXPECT_EQ(file.mesh.element_count(), 1U);
  EXPECT_EQ(ids_of_set(file, "All of it"), (std::vector<std::int64_t>{1, 2, 3, 4}));
  EXPECT_EQ(written(file), text);
}

// A comma at the end of a keyword's line continues it, but not with data.
TEST_F(AbaqusLeniency, ACommaAfterAKeywordSwallowsNoData) {
  const MeshFile file = read(
      "*NODE,\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*HEADING,\n"
      "*ELEMENT, TYPE=C3D4,\n10, 1, 2, 3, 4\n");
  EXPECT_EQ(file.mesh.node_count(), 4U);
  EXPECT_EQ(file.mesh.element_count(), 1U);
}

TEST_F(AbaqusLeniency, FollowsIncludesOfEveryForm) {
  std::filesystem::create_directory(scratch_.path("my mesh"));
  put_bytes(scratch_.path("my mesh/nodes.inp"), kTetrahedron.substr(0, kTetrahedron.find("*EL")));
  put_bytes(scratch_.path("my mesh/all.inp"), "*INCLUDE, INPUT=\"nodes.inp\"\n");
  const std::string cells = kTetrahedron.substr(kTetrahedron.find("*EL"));
  for (const std::string include :
       {"* include, input = \"my mesh/all.inp\"\n", "*INCLUDE,INPUT=my mesh\\all.inp\r\n"}) {
    EXPECT_EQ(read(include + cells).mesh.node_count(), 4U) << include;
  }
  const auto [reason, text] = error("*HEADING\nx\n*INCLUDE, INPUT=my mesh\\none.inp\n" + cells);
  EXPECT_EQ(reason, "FILE_NOT_FOUND");
  EXPECT_THAT(text, HasSubstr("in.inp: line 3: there is no file"));
  EXPECT_THAT(error("*NODE, INPUT=my mesh/nodes.inp, INPUT=other.inp\n" + cells).second,
              HasSubstr("in.inp: line 1: INPUT is given twice"));
}

TEST_F(AbaqusLeniency, NamesFilesOfOtherPrograms) {
  const struct {
    std::string text;
    std::string what;
  } files[] = {
      {"# made by\n4 1 0 0 0\n1 0 0 0\n", "an AVS UCD file (4 nodes, 1 cells)"},
      {"         4         1         0         0         0\r\n", "an AVS UCD file (4 nodes"},
      {"[TITLE]\nnet\n[JUNCTIONS]\n", "a network of EPANET or SWMM"},
      {" &CONTROL\n calculation='scf'\n/\n", "an input file of Quantum ESPRESSO"},
      {"&FORCE_EVAL\n", "an input file of CP2K"},
      {"&other\n", "a Fortran namelist"},
      {" $CONTRL SCFTYP=RHF $END\n", "an input file of GAMESS"},
      {"%chk=a.chk\n#p B3LYP/6-31G\n", "an input file of Gaussian"},
      {"! B3LYP def2-SVP\n* xyz 0 1\nH 0 0 0\n*\n", "an input file of ORCA"},
      {"! GRI-Mech\nELEMENTS\nO H\nEND\n", "a mechanism of CHEMKIN"},
      {"! model\n/PREP7\nN,1,0,0,0\n*DO,i,1,2\n", "a file of ANSYS commands"},
      {"*KEYWORD\n*NODE\n       1             0.0\n", "an LS-DYNA deck"},
      {"SOL 101\nCEND\nBEGIN BULK\n", "a Nastran deck"},
      {"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"},
  };
  for (const auto& [text, what] : files) {
    const auto [reason, message] = error(text);
    EXPECT_EQ(reason, "FORMAT_ERROR") << text;
    EXPECT_THAT(message, HasSubstr("in.inp: this is " + what)) << text;
    EXPECT_THAT(message, HasSubstr("not a deck of Abaqus or CalculiX")) << text;
  }
  EXPECT_THAT(error("\xFF\xFE*\0N\0"
                    "O\0")
                  .second,
              HasSubstr("in.inp: "))
      << "no keyword";
  EXPECT_THAT(error(std::string("\xFF\xFE*\0N\0", 6)).second, HasSubstr("UTF-16"));
}

}  // namespace
}  // namespace meshsmooth::formats

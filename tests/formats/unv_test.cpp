// Universal files of I-deas.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"
#include "second_order.hpp"
#include "unv_text.hpp"

namespace meshsmooth::formats {
namespace {

using namespace test::unv;
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
using ::testing::SizeIs;

class Unv : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.unv"), text);
    return read_mesh_file(scratch_.path("in.unv"));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file) const {
    write_mesh_file(scratch_.path("out.unv"), file);
    return bytes_of(scratch_.path("out.unv"));
  }

  const Scratch scratch_;
};

TEST_F(Unv, ReadsNodesAndElementsWithTheirLabels) {
  const MeshFile file = read(kPlane);

  EXPECT_EQ(file.file_node_id(4), 50);
  EXPECT_EQ(file.file_element_id(3), 4);
  ASSERT_THAT(file.mesh.blocks, SizeIs(1));
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4));
  EXPECT_EQ(find_regions(file).array, "gmsh:geometrical");
  EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 1, 1, 0));
}

TEST_F(Unv, KeepsEveryByteButThoseOfCoordinates) {
  const std::string text = data_set("151", "a header\n-1 is not alone in this line\n") + kPlane +
                           data_set("2414", "some results\n 1.0 2.0\n");
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);

  positions_of(file)[4] = {-1.0 / 3, 0.5, 0};
  EXPECT_THAT(changed_lines(text, written(file)),
              ElementsAre(real(-1.0 / 3) + real(0.5) + real(0)));
}

TEST_F(Unv, ReadsLinesThatEndAsInDos) {
  std::string text;
  for (const char c : kPlane) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  positions_of(file)[4].z = 0.125;
  EXPECT_EQ(written(file).size(), text.size());
}

// Data set 15 has 13 columns for a number, which must not spill into the next.
TEST_F(Unv, RoundsNumbersToTheColumnsOfTheOldNodes) {
  const std::string old =
      "        10         0         0        11  0.00000E+00  0.00000E+00  0.00000E+00\n"
      "        20         0         0        11  1.00000E+00  0.00000E+00  0.00000E+00\n"
      "        30         0         0        11  1.00000E+00  1.00000E+00 -1.00000E-99\n"
      "        40         0         0        11-1.00000E-100-1.00000E-100-1.00000E-100\n"
      "        50         0         0        11  4.00000D-01  6.00000D-01  0.00000D+00\n";
  MeshFile file = read(data_set("15", old) + data_set("2412", kTriangles));
  EXPECT_EQ(positions_of(file)[3].y, -1e-100);
  positions_of(file)[4] = {-1.0 / 3, 2.0 / 3, -1e-101};
  positions_of(file)[3].x = -1e200 / 3;

  const std::string text = written(file);

  EXPECT_THAT(text, HasSubstr("        50         0         0        11 -3.33333D-01 6.666667D-01"
                              " -1.0000D-101\n"));
  EXPECT_THAT(text, HasSubstr("        40         0         0        11 -3.3333E+199"
                              "-1.00000E-100-1.00000E-100\n"));
  MeshFile after = read(text);
  EXPECT_NEAR(positions_of(after)[4].y, 2.0 / 3, 1e-6);
}

TEST_F(Unv, WritesAllDigitsWhereNumbersAreNotInColumns) {
  const std::string text = data_set("2411",
                                    "1 1 1 11\n0.0E0 0.0 0.0\n2 1 1 11\n1.0 0.0 0.0\n"
                                    "3 1 1 11\n 0.5 1.0D0  0.0\n") +
                           data_set("2412", "1 91 1 1 7 3\n1 2 3\n");
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  positions_of(file)[2] = {1.0 / 3, 2.0 / 3, 0};
  EXPECT_THAT(written(file), HasSubstr(" 3.3333333333333331D-01 6.6666666666666663D-01  0.0\n"));
  const MeshFile after = read(written(file));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
}

TEST_F(Unv, ReadsSeveralDataSetsOfNodesAndElementsOfAllAges) {
  const std::string text =
      nodes_2411({kSquare[0], kSquare[1]}) +
      data_set("781", integers({30, 0, 0, 11}) + real(1) + real(1) + real(0) + "\n" +
                          integers({40, 0, 0, 11}) + real(0) + real(1) + real(0) + "\n") +
      data_set("15", integers({50, 0, 0, 11}).substr(0, 40) +
                         "  4.00000E-01  6.00000E-01  0.00000E+00\n") +
      data_set("71", integers({1, 4, 91, 1, 1, 7, 3}) + integers({10, 20, 50})) +
      data_set("780", integers({2, 91, 1, 5, 1, 1, 7, 3}) + integers({20, 30, 50}) +
                          integers({8, 21, 1, 5, 1, 1, 7, 2}) + integers({0, 1, 1, 1, 1}) +
                          integers({10, 20})) +
      data_set("2412", element(3, 41, {30, 40, 50}) + element(4, 54, {40, 10, 20, 30}));

  const MeshFile file = read(text);

  EXPECT_EQ(file.mesh.node_count(), 5U);
  ASSERT_THAT(file.mesh.blocks, SizeIs(2));
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 4, 1, 2, 4, 2, 3, 4));
  EXPECT_THAT(file.mesh.blocks[1].nodes, ElementsAre(3, 0, 1, 2));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 1);
  EXPECT_EQ(written(file), text);
}

// --- data sets and their ends --------------------------------------------------

TEST_F(Unv, SkipsBinaryDataByItsLength) {
  std::string bytes = "\n    -1\n  2411\n";
  bytes.insert(3, 1, '\0');
  const std::string binary = kMark + "    58b     1     2           2" +
                             integers({static_cast<std::int64_t>(bytes.size()), 0, 0}) +
                             "line 1\nline 2\n" + bytes + kMark;
  const MeshFile file = read(binary + kPlane);
  EXPECT_EQ(file.mesh.node_count(), 5U);
  EXPECT_EQ(written(file), binary + kPlane);
  EXPECT_EQ(error(binary.substr(0, binary.size() - 30)).first, "FILE_TRUNCATED");
}

TEST_F(Unv, NeedsNoLastMarkWhereNothingIsMissing) {
  const std::string unfinished = kPlane.substr(0, kPlane.size() - kMark.size());
  EXPECT_EQ(read(unfinished).mesh.element_count(), 4U);
  EXPECT_EQ(read(kPlane + "\n\n").mesh.element_count(), 4U);

  const std::string cut = nodes_2411(kSquare) + kMark + "  2412\n" + element(1, 91, {10, 20, 50});
  const auto [reason, text] = error(cut);
  EXPECT_EQ(reason, "FILE_TRUNCATED");
  EXPECT_THAT(text, HasSubstr("does not end with -1, and 2 nodes are in no element"));
}

// --- coordinate systems --------------------------------------------------------

std::string system(int label, int type, double shift) {
  return integers({label, type, 8}) + "a system\n" + real(1) + real(0) + real(0) + "\n" + real(0) +
         real(1) + real(0) + "\n" + real(0) + real(0) + real(1) + "\n" + real(shift) + real(0) +
         real(0) + "\n";
}

TEST_F(Unv, ReadsNodesInOneCartesianSystemOnly) {
  const auto with = [](const std::string& systems, int other) {
    std::string nodes;
    for (const Node& node : kSquare) {
      nodes += integers({node.label, node.label == 50 ? other : 1, 1, 11}) + real(node.at.x) +
               real(node.at.y) + real(node.at.z) + "\n";
    }
    return data_set("2420", integers({1}) + "part\n" + systems) + data_set("2411", nodes) +
           data_set("2412", kTriangles);
  };
  EXPECT_EQ(read(with(system(1, 0, 0) + system(2, 1, 0), 1)).mesh.node_count(), 5U);
  EXPECT_EQ(read(with(system(1, 0, 9), 1)).mesh.node_count(), 5U) << "all are shifted";
  EXPECT_EQ(read(with(system(1, 0, 0) + system(2, 0, 0), 2)).mesh.node_count(), 5U);
  EXPECT_THAT(error(with(system(1, 0, 0) + system(2, 1, 0), 2)).second,
              HasSubstr("node 50 is given in coordinate system 2, which is not Cartesian"));
  EXPECT_THAT(error(with(system(1, 0, 0) + system(2, 0, 3), 2)).second,
              HasSubstr("node 50 is given in coordinate system 2, other nodes in others"));
}

TEST_F(Unv, SaysWhatIsWrongWithAFileAndWhere) {
  const std::string nodes = nodes_2411(kSquare);
  const struct {
    std::string text;
    std::string reason;
    std::string what;
  } files[] = {
      {"a letter\n", "FORMAT_ERROR", "line 1: expected -1, which opens a data set, found \"a let"},
      {"\n", "FORMAT_ERROR", "expected -1"},
      {kMark + "  mesh\n" + kMark, "FORMAT_ERROR", "line 2: expected a number, found \"mesh\""},
      {data_set("2411", integers({1, 1, 1, 11})), "FORMAT_ERROR", "the coordinates of node 1"},
      {data_set("2411", integers({1, 1, 1, 11}) + "0.0 1.0\n"), "FORMAT_ERROR",
       "line 4: expected three coordinates"},
      {data_set("2411", integers({1, 1, 1, 11}) + "0.0 x 1.0\n"), "FORMAT_ERROR", "found \"x\""},
      {kMark + "  2411\n" + integers({1, 1, 1, 11}), "FILE_TRUNCATED", "ends too early"},
      {data_set("15", "12 3\n"), "FORMAT_ERROR", "line 3: expected three coordinates"},
      {data_set("15", "        12         0         0        11  0.00000E+00\n"), "FORMAT_ERROR",
       "expected three coordinates"},
      {data_set("2411", integers({1, 1, 1, 11}) + "   0.0000000000000000D+0" +
                            std::string(80, '7') + " 1.0\n"),
       "FORMAT_ERROR", "line 4: expected three coordinates"},
      {nodes + nodes, "FORMAT_ERROR", "two nodes have the number 10"},
      {nodes + data_set("2412", kTriangles + kTriangles), "FORMAT_ERROR",
       "two elements have the number 1"},
      {nodes + data_set("2412", element(5, 91, {10, 20, 99})), "FORMAT_ERROR",
       "element 5 uses node 99, which is not in the file"},
      {nodes + data_set("2412", integers({5, 91, 1, 1, 7, 3}) + integers({10, 20})), "FORMAT_ERROR",
       "the other nodes of element 5, which has 3"},
      {nodes + data_set("2412", integers({5, 91, 1, 1, 7, 3}) + integers({10, 20, 30, 40})),
       "FORMAT_ERROR", "only the 3 nodes of element 5"},
      {nodes + data_set("2412", integers({5, 91, 3})), "FORMAT_ERROR",
       "expected 6 numbers, which end with the number of an element's nodes"},
      {kPlane + data_set("2467", integers({1, 0, 0, 0, 0, 0, 0, 3}) + "g\n" + integers({8, 1})),
       "FORMAT_ERROR", "entities of 4 numbers each"},
      {kPlane +
           data_set("2467", integers({1, 0, 0, 0, 0, 0, 0, 3}) + "g\n" + integers({8, 1, 0, 0})),
       "FORMAT_ERROR", "2 more entities of group g"},
      {nodes, "MESH_EMPTY", "there are no surface or volume elements"},
      {data_set("2412", ""), "MESH_EMPTY", "no nodes"},
  };
  for (const auto& [text, reason, what] : files) {
    const auto [found, message] = error(text);
    EXPECT_EQ(found, reason) << text;
    EXPECT_THAT(message, HasSubstr(what)) << text;
    EXPECT_THAT(message, HasSubstr("in.unv: ")) << text;
  }
}

// --- other formats -------------------------------------------------------------

TEST_F(Unv, CarriesTheMeshOfAnotherFormatWithItsSets) {
  const MeshFile deck = read_mesh_file(fixture("mixed.su2"));
  EXPECT_EQ(error_of([&] { static_cast<void>(written(deck)); }).first, "ELEMENT_NOT_SUPPORTED")
      << "it has a pyramid";
  put_bytes(scratch_.path("a.su2"),
            "NDIME= 2\nNELEM= 2\n5 0 1 2\n9 1 3 4 2\nNPOIN= 5\n0 0\n1 0\n0 1\n2 0\n2 1\n"
            "NMARK= 1\nMARKER_TAG= wall\nMARKER_ELEMS= 2\n3 0 1\n3 1 3\n");
  const MeshFile file = read_mesh_file(scratch_.path("a.su2"));

  const MeshFile after = read(written(file));

  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(after.mesh, file.mesh);
  EXPECT_EQ(after.lower_dimensional_cell_count(), 2);
  EXPECT_EQ(find_node_set(after, "wall"), find_node_set(file, "wall"));
}

}  // namespace
}  // namespace meshsmooth::formats

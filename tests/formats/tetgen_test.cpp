// Meshes of TetGen.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TetGen : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& nodes, const std::string& elements) const {
    put_bytes(scratch_.path("a.1.node"), nodes);
    put_bytes(scratch_.path("a.1.ele"), elements);
    return read_mesh_file(scratch_.path("a.1.node"));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& nodes,
                                                          const std::string& elements) const {
    return error_of([&] { static_cast<void>(read(nodes, elements)); });
  }

  const Scratch scratch_;
};

const std::string kNodes = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";

TEST_F(TetGen, ReadsCommentsBlankLinesAndNumbersFrom0Or1) {
  for (const int first : {0, 1}) {
    std::string nodes = "# nodes\n\n4  3  1  1 # as TetGen has it\n\n";
    const char* const places[] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    for (int node = 0; node < 4; ++node) {
      nodes += "  " + std::to_string(node + first) + "  " + places[node] + "  .5 7\n\n# more\n";
    }
    const std::string elements = "# one\n1 4 1\n\n" + std::to_string(first) + " " +
                                 std::to_string(first) + " " + std::to_string(first + 1) + " " +
                                 std::to_string(first + 2) + " " + std::to_string(first + 3) +
                                 " 2.5\n# end\n";
    MeshFile file = read(nodes, elements);
    EXPECT_THAT(file.mesh.blocks.at(0).nodes, ElementsAre(0, 1, 2, 3));
    EXPECT_EQ(file.file_node_id(0), first);
    EXPECT_THAT(file.notes(), IsEmpty());
    positions_of(file)[3].z = 2;
    write_mesh_file(scratch_.path("b.ele"), file);
    nodes.replace(nodes.rfind("0 0 1"), 5, "0 0 2");
    EXPECT_EQ(bytes_of(scratch_.path("b.node")), nodes);
    EXPECT_EQ(bytes_of(scratch_.path("b.ele")), elements);
  }
}

TEST_F(TetGen, TheFirstLineMayLeaveOutItsEnd) {
  const MeshFile file = read("4\n" + kNodes.substr(8), "1\n1 1 2 3 4\n");
  EXPECT_EQ(file.mesh.element_count(), 1U);
  EXPECT_THAT(file.notes(), IsEmpty());
}

TEST_F(TetGen, ReadsALineAsFarAsTheFirstLineTells) {
  const MeshFile file =
      read("4 3 1 0\n1 0 0 0 .5 9\n2 1 0 0\n3 0 1 0 1.5 9\n4 0 0 1 1\n5 1 1 1 1\n",
           "1 4 0\n1 1 2 3 4 8\n");
  EXPECT_EQ(file.mesh.node_count(), 4U);
  EXPECT_THAT(file.content()->dataset->node_column("tetgen:attribute_0")->values,
              ElementsAre(0.5, 0, 1.5, 1));
  ASSERT_EQ(file.notes().size(), 4U);
  EXPECT_EQ(file.notes()[0],
            "node 1 has more numbers than the first line announces, which are "
            "ignored (and 1 more)");
  EXPECT_THAT(file.notes()[1], HasSubstr("2 has fewer numbers than the first line announces"));
  EXPECT_THAT(file.notes()[2], HasSubstr("a.1.node: the lines after the last one"));
  EXPECT_THAT(file.notes()[3], HasSubstr("element 1 has more numbers"));
}

TEST_F(TetGen, FindsTheOtherFileInCapitals) {
  put_bytes(scratch_.path("A.NODE"), kNodes);
  put_bytes(scratch_.path("A.ELE"), "1 4 0\n1 1 2 3 4\n");
  EXPECT_EQ(read_mesh_file(scratch_.path("A.ELE")).mesh.element_count(), 1U);
}

TEST_F(TetGen, NamesTheFileThatIsMissing) {
  put_bytes(scratch_.path("b.1.node"), kNodes);
  auto [reason, text] = error_of([&] { (void)read_mesh_file(scratch_.path("b.1.node")); });
  EXPECT_EQ(reason, "FILE_NOT_FOUND");
  EXPECT_THAT(text, HasSubstr("b.1.ele: "));
  put_bytes(scratch_.path("c.ele"), "1 4 0\n1 1 2 3 4\n");
  EXPECT_THAT(error_of([&] { (void)read_mesh_file(scratch_.path("c.ele")); }).second,
              HasSubstr("c.node: "));
}

TEST_F(TetGen, SaysWhatIsWrongAndWhere) {
  const std::string one = "1 4 0\n1 1 2 3 4\n";
  const struct {
    std::string nodes;
    std::string elements;
    std::string reason;
    std::string what;
  } files[] = {
      {"4 2 0 0\n1 0 0\n", one, "FORMAT_ERROR", "three dimensions, found \"2, as of Triangle\""},
      {"5" + kNodes.substr(1), one, "FILE_TRUNCATED", "a.1.node"},
      {"4 3 0 0\n1 0 0 0\n2 1 0\n3 0 1 0\n4 0 0 1\n", one, "FORMAT_ERROR",
       "line 4: expected more numbers in the line before"},
      {kNodes, "2 4 0\n1 1 2 3 4\n", "FILE_TRUNCATED", "a.1.ele"},
      {kNodes, "1 4 0\n1 1 2 3\n", "FILE_TRUNCATED", "a.1.ele"},
      {kNodes, "2 4 0\n1 1 2 3\n2 1 2 3 4\n", "FORMAT_ERROR", "more numbers in the line before"},
      {kNodes, "1 4 0\n1 1 2 3 5\n", "FORMAT_ERROR",
       "line 2: expected the number of a node in the .node file, found \"5\""},
      {kNodes, "1 5 0\n1 1 2 3 4 4\n", "ELEMENT_NOT_SUPPORTED", "its elements have 5 nodes"},
  };
  for (const auto& [nodes, elements, reason, what] : files) {
    const auto [found, text] = error(nodes, elements);
    EXPECT_EQ(found, reason) << nodes << elements;
    EXPECT_THAT(text, HasSubstr(what)) << nodes << elements;
  }
}

}  // namespace
}  // namespace meshsmooth::formats

// ".stl" files come back as they were, but for their vertices and the normals of the triangles that
// these change.

#include <gmock/gmock.h>

#include <bit>
#include <cstring>

#include "compare.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string facet(const std::string& normal, const std::string& a, const std::string& b,
                  const std::string& c) {
  return "  facet normal " + normal + "\n    outer loop\n      vertex " + a + "\n      vertex " +
         b + "\n      vertex  " + c + "\n    endloop\n  endfacet\n";
}

const std::string kOne = facet("0 0 1.0", "0 0 0", "1 0 0", "1.0 1 0");
const std::string kOther = facet("0 0 0", "0 0 0", "1 1 -0", "0 1e0 0");

class Stl : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& bytes) const {
    put_bytes(scratch_.path("in.stl"), bytes);
    return read_mesh_file(scratch_.path("in.stl"));
  }
  [[nodiscard]] std::string written(const MeshFile& file) const {
    write_mesh_file(scratch_.path("out.stl"), file);
    return bytes_of(scratch_.path("out.stl"));
  }
  /// With the third node, (1, 1, 0), at (1, 1, 1).
  [[nodiscard]] std::string moved(const std::string& bytes) const {
    const MeshFile before = read(bytes);
    EXPECT_EQ(written(before), bytes);
    MeshFile file = before;
    std::get<std::vector<Vec3f>>(file.mesh.positions)[2].z = 1;
    std::string result = written(file);
    const MeshFile after = read_mesh_file(scratch_.path("out.stl"));
    EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
    const FileDifference difference = compare_files(before, after);
    EXPECT_THAT(difference.differences, IsEmpty());
    EXPECT_EQ(difference.compared_by, ComparedBy::bytes);
    return result;
  }

  const Scratch scratch_;
};

TEST_F(Stl, TextKeepsItsSolidsAndComputesNormalsOfWhatMoves) {
  const std::string rest = "endsolid a part\nsolid another part\n" +
                           facet("0 0 -1", "5 5 5", "5 6 5", "6 5 5") + "endsolid another part\n";
  const std::string text = "solid a part facet 1\n" + kOne + kOther + rest;
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.node_count(), 7u);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 0, 2, 3, 4, 5, 6));
  // A normal of 0 asks readers to compute it.
  EXPECT_EQ(moved(text), "solid a part facet 1\n" +
                             facet("0 -0.70710677 0.70710677", "0 0 0", "1 0 0", "1.0 1 1") +
                             facet("0 0 0", "0 0 0", "1 1 1", "0 1e0 0") + rest);
}

TEST_F(Stl, CapitalsAndBlanksBeforeAreRead) {
  std::string text = "\n SOLID X\n" + kOne + "ENDSOLID X\n";
  for (char& letter : text) letter = static_cast<char>(std::toupper(letter));
  EXPECT_EQ(read(text).mesh.element_count(), 1u);
}

std::string binary(std::initializer_list<float> numbers, const std::string& header) {
  std::string bytes = header;
  bytes.resize(80, '\0');
  const auto count = static_cast<std::uint32_t>(numbers.size() / 12);
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  std::size_t place = 0;
  for (const float number : numbers) {
    bytes.append(reinterpret_cast<const char*>(&number), 4);
    if (++place % 12 == 0) bytes += "\x1F\x7C";  // a colour
  }
  return bytes;
}

TEST_F(Stl, BinaryKeepsItsHeaderAndAttributes) {
  for (const char* header : {"solid COLOR=abcd facet", "made by hand"}) {
    const float root = std::bit_cast<float>(0x3f3504f3);          // of 1/2
    EXPECT_EQ(moved(binary({0, 0, 1, 0, 0, 0, 1, 0, 0, 1,  1, 0,  //
                            0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0},
                           header)),
              binary({0, -root, root, 0, 0, 0, 1, 0, 0, 1,  1, 1,  //
                      0, 0,     1,    0, 0, 0, 0, 1, 0, -1, 0, 0},
                     header));
  }
}

TEST_F(Stl, CountsTrianglesThatAreNone) {
  const std::string text = "solid\n" + kOne + facet("0 0 1", "1 1 0", "1 0 0", "1 1 0") +
                           facet("nan nan nan", "7 7 7", "7 7 7", "7 7 7") + kOther + "endsolid\n";
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.element_count(), 2u);
  ASSERT_EQ(file.held_cells().size(), 1u);
  EXPECT_EQ(file.held_cells()[0].name, "degenerate facet");
  EXPECT_EQ(file.held_cells()[0].count, 2);
  EXPECT_EQ(written(file), text);
}

TEST_F(Stl, SaysWhatIsWrong) {
  const auto text_of = [&](const std::string& bytes) {
    return error_of([&] { (void)read(bytes); }).second;
  };
  EXPECT_THAT(text_of("solid\n" + kOne), HasSubstr("there is no endsolid"));
  EXPECT_THAT(text_of("solid\n" + kOne + "surface 1\nendsolid\n"),
              HasSubstr("line 9: expected facet or endsolid, found \"surface\""));
  EXPECT_THAT(text_of("solid\n" + facet("0 0 1", "0 0 0", "1 0 0 vertex 2 0 0", "1 1 0")),
              HasSubstr("line 6: expected endloop, found \"vertex\""));
  const std::string bytes = binary({0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0}, "x");
  EXPECT_THAT(text_of(bytes + std::string(50, '\0')),
              HasSubstr("it announces 1 triangles, but has room for 2"));
  EXPECT_THAT(text_of(bytes.substr(0, 100)), HasSubstr("it should hold 1 triangles, 134 bytes"));
}

TEST_F(Stl, IsMadeOfOtherFormatsWithNormals) {
  put_bytes(scratch_.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
  const std::string bytes = written(read_mesh_file(scratch_.path("a.obj")));
  ASSERT_EQ(bytes.size(), 84u + 2 * 50);
  float z = 0;
  std::memcpy(&z, bytes.data() + 84 + 8, sizeof z);
  EXPECT_EQ(z, 1);
  EXPECT_EQ(read(bytes).mesh.element_count(), 2u);
  put_bytes(scratch_.path("a.obj"),
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\nf 1 2 3\nf 1 2 3 "
            "4 5\n");
  EXPECT_THAT(error_of([&] { (void)written(read_mesh_file(scratch_.path("a.obj"))); }).second,
              HasSubstr(".stl files cannot carry a polygon"));
}

}  // namespace
}  // namespace meshsmooth::formats

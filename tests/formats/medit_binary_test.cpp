// Medit's binary meshes; from Medit's formats to others and back.

#include <gmock/gmock.h>

#include <cstring>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"
#include "second_order.hpp"

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
using ::testing::SizeIs;

class MeditBinary : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text, const std::string& name = "in.mesh") const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(
      const std::string& text, const std::string& name = "in.mesh") const {
    return error_of([&] { static_cast<void>(read(text, name)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file,
                                    const std::string& name = "out.mesh") const {
    write_mesh_file(scratch_.path(name), file);
    return bytes_of(scratch_.path(name));
  }

  const Scratch scratch_;
};

// --- binary --------------------------------------------------------------------

/// Writes numbers as a binary file of some version has them.
class Bytes {
 public:
  Bytes(int version, bool big) : version_(version), big_(big) {
    integer(1, 4);
    integer(static_cast<std::uint64_t>(version), 4);
  }
  void open(int code) {
    integer(static_cast<std::uint64_t>(code), 4);
    place_ = text.size();
    integer(0, position_bytes());
  }
  void close() {
    Bytes next(version_, big_);
    next.text.clear();
    next.integer(text.size(), position_bytes());
    text.replace(place_, next.text.size(), next.text);
  }
  void count(std::uint64_t value) { integer(value, version_ == 4 ? 8 : 4); }
  void integer(std::uint64_t value, std::size_t size) {
    std::string bytes;
    for (std::size_t byte = 0; byte < size; ++byte) {
      bytes += static_cast<char>(value >> 8 * byte & 0xFF);
    }
    text += big_ ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
  }
  void real(double value) {
    std::uint64_t bits = 0;
    const auto single = static_cast<float>(value);
    if (version_ == 1) {
      std::memcpy(&bits, &single, 4);
    } else {
      std::memcpy(&bits, &value, 8);
    }
    integer(bits, version_ == 1 ? 4 : 8);
  }
  std::string text;

 private:
  [[nodiscard]] std::size_t position_bytes() const { return version_ >= 3 ? 8 : 4; }
  int version_;
  bool big_;
  std::size_t place_ = 0;
};

/// Of `dimension`: a square of two triangles, vertex 3 required; with a section of no interest.
std::string binary(int version, bool big, int dimension) {
  Bytes bytes(version, big);
  bytes.open(3);
  bytes.integer(static_cast<std::uint64_t>(dimension), 4);
  bytes.close();
  bytes.open(62);  // SolAtVertices
  bytes.text += "anything";
  bytes.close();
  bytes.open(4);
  bytes.count(4);
  for (int node = 0; node < 4; ++node) {
    bytes.real(node % 2 + 0.5);
    bytes.real(node / 2 - 0.25);
    if (dimension == 3) bytes.real(0.125);
    bytes.count(static_cast<std::uint64_t>(node));
  }
  bytes.close();
  bytes.open(6);
  bytes.count(2);
  for (const std::uint64_t number : {1, 2, 4, 7, 1, 4, 3, 8}) bytes.count(number);
  bytes.close();
  bytes.open(15);
  bytes.count(1);
  bytes.count(3);
  bytes.close();
  bytes.open(54);
  return bytes.text;
}

TEST_F(MeditBinary, ReadsAndWritesBinaryFilesOfAllVersionsAndByteOrders) {
  for (int version = 1; version <= 4; ++version) {
    for (const bool big : {false, true}) {
      for (const int dimension : {2, 3}) {
        const std::string bytes = binary(version, big, dimension);
        MeshFile file = read(bytes, "in.meshb");
        EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 3, 0, 3, 2));
        EXPECT_THAT(ids_of_set(file, "RequiredVertices"), ElementsAre(3));
        EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 1));
        EXPECT_EQ(written(file, "out.meshb"), bytes);

        const Vec3d to = {1.0 / 3, -2.0 / 3, dimension == 3 ? 0.2 : 0};
        if (version == 1) {
          std::get<std::vector<Vec3f>>(file.mesh.positions)[1] = vec3_cast<float>(to);
        } else {
          positions_of(file)[1] = to;
        }
        EXPECT_EQ(written(file, "out.meshb").size(), bytes.size());
        const MeshFile after = read_mesh_file(scratch_.path("out.meshb"));
        EXPECT_TRUE(after.mesh.positions == file.mesh.positions) << version << big << dimension;
        EXPECT_EQ(read(bytes, "named.mesh").mesh.element_count(), 2U) << "whatever its name";
      }
    }
  }
}

TEST_F(MeditBinary, SaysWhatIsWrongWithABinaryFile) {
  const std::string bytes = binary(2, false, 3);
  for (std::size_t size = 1; size + 8 < bytes.size(); size += 5) {
    const auto [reason, text] = error(bytes.substr(0, size), "in.meshb");
    EXPECT_TRUE(reason == "FILE_TRUNCATED" || reason == "FORMAT_ERROR" || reason == "MESH_EMPTY")
        << size << reason << text;
  }
  const auto with = [&](std::size_t place, char byte) {
    std::string changed = bytes;
    changed[place] = byte;
    return error(changed, "in.meshb").second;
  };
  EXPECT_THAT(with(4, 9), HasSubstr("expected a version from 1 to 4, found 9"));
  EXPECT_THAT(with(12, 8), HasSubstr("the section after number 3 does not start behind it"));
  EXPECT_THAT(with(16, 4), HasSubstr("expected dimension 2 or 3, found 4"));
  EXPECT_THAT(with(44, 5), HasSubstr("Vertices: 5 rows do not fit into the section"));
}

// --- other formats -------------------------------------------------------------

TEST_F(MeditBinary, CarriesTheMeshOfAnotherFormat) {
  const MeshFile file = read_mesh_file(fixture("mixed.su2"));
  for (const char* name : {"out.mesh", "out.meshb"}) {
    (void)written(file, name);
    const MeshFile after = read_mesh_file(scratch_.path(name));
    EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
    test::expect_same_connectivity(after.mesh, file.mesh);
    EXPECT_EQ(after.lower_dimensional_cell_count(), file.lower_dimensional_cell_count());
  }
}

TEST_F(MeditBinary, TurnsFromTextToBinaryAndBackWithWhatMustStay) {
  const std::string text =
      "MeshVersionFormatted 2\nDimension 2\nVertices\n5\n0 0 1\n1 0 1\n1 1 2\n0 1 2\n0.4 0.6 0\n"
      "Edges\n2\n1 2 1\n2 3 2\nTriangles\n4\n1 2 5 7\n2 3 5 7\n3 4 5 8\n4 1 5 8\n"
      "Corners\n2\n1\n3\nRequiredEdges\n1\n2\nEnd\n";
  const MeshFile file = read(text);
  (void)written(file, "out.meshb");
  const MeshFile after = read_mesh_file(scratch_.path("out.meshb"));

  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  EXPECT_EQ(after.mesh.fixed, file.mesh.fixed);
  EXPECT_THAT(ids_of_set(after, "Corners"), ElementsAre(1, 3));
  EXPECT_EQ(find_regions(after).of_element, find_regions(file).of_element);
  EXPECT_THAT(written(after, "back.mesh"), HasSubstr("Dimension 2\nVertices\n5\n0 0 1\n"));
}

TEST_F(MeditBinary, CarriesElementsOfSecondOrder) {
  using enum ElementType;
  for (const ElementType type : {triangle6, quad9, tetrahedron10, wedge18, hexahedron27}) {
    const MeshFile file(test::crooked_element(type));
    for (const char* name : {"out.mesh", "out.meshb"}) {
      (void)written(file, name);
      const MeshFile after = read_mesh_file(scratch_.path(name));
      EXPECT_EQ(test::check_cells(after).size(), 1U);
      test::expect_same_connectivity(after.mesh, file.mesh);
    }
  }
  EXPECT_EQ(error_of([&] { (void)written(MeshFile(test::crooked_element(quad8))); }).first,
            "ELEMENT_NOT_SUPPORTED");
}

}  // namespace
}  // namespace meshsmooth::formats

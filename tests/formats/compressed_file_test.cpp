// Files that gzip compressed, whatever they are called.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "compare.hpp"
#include "gzip.hpp"
#include "scratch.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::fixture;
using test::move_nodes;
using test::put_bytes;
using test::Scratch;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// The fixture, compressed, as a file of this name.
std::filesystem::path compressed(const Scratch& scratch, const std::string& name,
                                 const std::string& as) {
  compress_gzip(fixture(name), scratch.path(as));
  return scratch.path(as);
}

std::string decompressed(const std::filesystem::path& path) {
  return decompress_gzip(path, bytes_of(path));
}

class Compressed : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Files, Compressed,
                         ::testing::Values("roof.obj", "tile.ply", "tile_big_endian.ply",
                                           "mixed.su2", "deck.inp", "parts.inp", "plate.bdf"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST_P(Compressed, IsReadAsTheFileItself) {
  const Scratch scratch;
  const MeshFile plain = read_mesh_file(fixture(GetParam()));
  for (const std::string& name : {std::string(GetParam()) + ".gz", std::string(GetParam()),
                                  std::string(GetParam()) + ".GZ"}) {
    const MeshFile file = read_mesh_file(compressed(scratch, GetParam(), name));

    EXPECT_TRUE(file.mesh.positions == plain.mesh.positions) << name;
    const FileDifference difference = compare_files(plain, file);
    EXPECT_TRUE(difference.only_coordinates()) << name;
    EXPECT_EQ(difference.compared_by, ComparedBy::bytes) << name;
  }
}

TEST_P(Compressed, IsWrittenAsTheFileItself) {
  const Scratch scratch;
  const auto path = compressed(scratch, GetParam(), std::string(GetParam()) + ".gz");
  MeshFile file = read_mesh_file(path);
  move_nodes(file.mesh);
  const auto plain = scratch.path(std::string("plain.") + GetParam());
  write_mesh_file(plain, file);

  write_mesh_file(path, file);

  EXPECT_EQ(decompressed(path), bytes_of(plain));
  EXPECT_EQ(scratch.file_count(), 2U);
  const std::string first = bytes_of(path);
  write_mesh_file(path, file);
  EXPECT_EQ(bytes_of(path), first);
  EXPECT_EQ(first.substr(3, 5), std::string(5, '\0'));  // no name, no time
}

TEST(CompressedFile, MayHaveSeveralMembersAndPadding) {
  const Scratch scratch;
  const std::string text = bytes_of(fixture("roof.obj"));
  put_bytes(scratch.path("a"), text.substr(0, 100));
  put_bytes(scratch.path("b"), text.substr(100));
  compress_gzip(scratch.path("a"), scratch.path("a.gz"));
  compress_gzip(scratch.path("b"), scratch.path("b.gz"));
  const auto path = scratch.path("roof.obj.gz");
  put_bytes(path, bytes_of(scratch.path("a.gz")) + bytes_of(scratch.path("b.gz")) +
                      std::string(512, '\0'));

  EXPECT_EQ(read_bytes(path), text);
}

TEST(CompressedFile, TellsWhereItIsDamaged) {
  const Scratch scratch;
  const auto path = compressed(scratch, "mixed.su2", "mixed.su2.gz");
  const std::string bytes = bytes_of(path);
  const auto error = [&](const std::string& damaged) {
    put_bytes(path, damaged);
    const auto [reason, text] = error_of([&] { static_cast<void>(read_mesh_file(path)); });
    EXPECT_THAT(text, StartsWith(path.string() + ": "));
    return reason + ": " + text.substr(path.string().size() + 2);
  };
  for (const std::size_t size :
       {std::size_t{3}, std::size_t{11}, bytes.size() / 2, bytes.size() - 4, bytes.size() - 1}) {
    EXPECT_EQ(error(bytes.substr(0, size)), "FILE_TRUNCATED: the compressed data end too early")
        << size;
  }
  std::string damaged = bytes;
  damaged[bytes.size() / 2] ^= 0x55;
  EXPECT_THAT(error(damaged), StartsWith("FORMAT_ERROR: byte "));
  damaged = bytes;
  damaged[bytes.size() - 6] ^= 1;  // the checksum
  EXPECT_THAT(error(damaged), HasSubstr("the compressed data are damaged"));
  EXPECT_THAT(error(bytes + "\n*END\n"), HasSubstr("6 bytes follow that are not gzip's"));
  EXPECT_THAT(error("NDIME= 2\n"), StartsWith("FORMAT_ERROR: its name says gzip"));
  EXPECT_THAT(error(""), StartsWith("FILE_TRUNCATED: the file is empty"));
}

TEST(CompressedFile, OfADeckFindsTheFilesBesideIt) {
  const Scratch scratch;
  const std::string deck = bytes_of(fixture("deck.inp"));
  const std::size_t at = deck.find("\n*") + 1;
  ASSERT_NE(deck.find("*NODE"), std::string::npos);
  put_bytes(scratch.path("rest"), deck.substr(at));
  compress_gzip(scratch.path("rest"), scratch.path("rest.inc.gz"));
  put_bytes(scratch.path("main"), deck.substr(0, at) + "*INCLUDE, INPUT=rest.inc.gz\n");
  const auto path = scratch.path("main.inp.gz");
  compress_gzip(scratch.path("main"), path);
  const std::string main_bytes = bytes_of(scratch.path("main"));
  MeshFile file = read_mesh_file(path);
  const MeshFile whole = read_mesh_file(fixture("deck.inp"));
  EXPECT_TRUE(file.mesh.positions == whole.mesh.positions);
  test::double_positions(file.mesh);

  write_mesh_file(path, file);

  EXPECT_EQ(decompressed(path), main_bytes);
  EXPECT_TRUE(read_mesh_file(path).mesh.positions == file.mesh.positions);
  EXPECT_TRUE(is_gzip(bytes_of(scratch.path("rest.inc.gz"))));
}

TEST(CompressedFile, IsRefusedWhereTwoFilesBelongTogether) {
  const Scratch scratch;
  for (const char* name : {"tetgen.node", "tetgen.ele"}) {
    const auto path = compressed(scratch, name, std::string(name) + ".gz");
    const auto [reason, text] = error_of([&] { static_cast<void>(read_mesh_file(path)); });
    EXPECT_EQ(reason, "FORMAT_UNKNOWN");
    EXPECT_THAT(text, HasSubstr("so they cannot be compressed alone"));
    EXPECT_EQ(error_of([&] { check_writable(path); }).first, "FORMAT_UNKNOWN");
  }
}

class CompressedCase : public ::testing::Test {
 protected:
  CompressedCase() {
    std::filesystem::copy(fixture("foam"), case_, std::filesystem::copy_options::recursive);
    for (const char* name : {"points", "faces", "owner", "neighbour", "boundary"}) {
      compress_gzip(mesh_file(name), mesh_file(std::string(name) + ".gz"));
      std::filesystem::remove(mesh_file(name));
    }
  }
  [[nodiscard]] std::filesystem::path mesh_file(const std::string& name) const {
    return case_ / "constant" / "polyMesh" / name;
  }

  const Scratch scratch_;
  const std::filesystem::path case_ = scratch_.path("case");
};

TEST_F(CompressedCase, IsReadAndItsPointsAreWrittenCompressed) {
  const MeshFile plain = read_mesh_file(fixture("foam"));
  MeshFile file = read_mesh_file(case_);
  EXPECT_TRUE(compare_files(plain, file).only_coordinates());
  move_nodes(file.mesh);

  write_mesh_file(case_, file);

  EXPECT_FALSE(std::filesystem::exists(mesh_file("points")));
  EXPECT_TRUE(is_gzip(bytes_of(mesh_file("points.gz"))));
  EXPECT_TRUE(read_mesh_file(case_).mesh.positions == file.mesh.positions);
}

TEST_F(CompressedCase, IsCopiedAsItIs) {
  const auto copy = scratch_.path("copy/");
  write_mesh_file(copy, read_mesh_file(case_));

  const auto folder = scratch_.path("copy") / "constant" / "polyMesh";
  EXPECT_EQ(bytes_of(folder / "faces.gz"), bytes_of(mesh_file("faces.gz")));
  EXPECT_TRUE(compare_files(read_mesh_file(case_), read_mesh_file(copy)).only_coordinates());
}

TEST_F(CompressedCase, IsNotWrittenBesideAnUncompressedMeshThatOpenFoamWouldRead) {
  const auto other = scratch_.path("other");
  std::filesystem::copy(fixture("foam"), other, std::filesystem::copy_options::recursive);
  const MeshFile file = read_mesh_file(case_);

  const auto [reason, text] = error_of([&] { write_mesh_file(other, file); });

  EXPECT_EQ(reason, "FILE_NOT_WRITABLE");
  EXPECT_THAT(text, HasSubstr("OpenFOAM would read the old"));
}

}  // namespace
}  // namespace meshsmooth::formats

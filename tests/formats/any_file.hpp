#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cctype>
#include <thread>

#include "compare.hpp"
#include "content.hpp"
#include "full_disk.hpp"
#include "gzip.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats::test {

/// The mesh of a file is the same compressed, in capitals, under a name without a format and
/// through a pipe; and so is what is written under such names.
inline void expect_same_by_any_name(const Scratch& scratch, const std::filesystem::path& plain) {
  const std::string extension = plain.extension();
  std::string capitals = extension;
  for (char& letter : capitals) letter = static_cast<char>(std::toupper(letter));
  const MeshFile expected = read_mesh_file(plain);
  const auto check = [&](const std::string& name, const std::string& format) {
    SCOPED_TRACE(name);
    const MeshFile file = read_mesh_file(scratch.path(name), format);
    EXPECT_TRUE(file.mesh.positions == expected.mesh.positions);
    EXPECT_TRUE(compare_files(expected, file).only_coordinates());
    EXPECT_EQ(file.content()->extension, expected.content()->extension);
    MeshFile moved = file;
    double_positions(moved.mesh);
    const std::string out = "out." + name;
    write_mesh_file(scratch.path(out), moved, format);
    EXPECT_TRUE(read_mesh_file(scratch.path(out), format).mesh.positions == moved.mesh.positions);
    EXPECT_EQ(is_gzip(bytes_of(scratch.path(out))), is_gzip_name(out));
  };
  compress_gzip(plain, scratch.path("packed" + extension + ".gz"));
  check("packed" + extension + ".gz", "");
  std::filesystem::copy_file(plain, scratch.path("CAPITALS" + capitals));
  check("CAPITALS" + capitals, "");
  std::filesystem::copy_file(plain, scratch.path("unknown.dat"));
  check("unknown.dat", extension.substr(1));

  const auto pipe = scratch.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::jthread writer([&] { put_bytes(pipe, bytes_of(plain)); });
  EXPECT_TRUE(read_mesh_file(pipe, extension).mesh.positions == expected.mesh.positions);
}

/// What is wrong with a file that is not read from its place is said of that place.
inline void expect_errors_to_name(const std::filesystem::path& path) {
  put_bytes(path, "no mesh at all\n");
  EXPECT_THAT(error_of([&] { static_cast<void>(read_mesh_file(path)); }).second,
              ::testing::AllOf(::testing::StartsWith(path.string() + ": "),
                               ::testing::Not(::testing::HasSubstr("meshsmooth-/"))));
}

/// Moved and written to a full disk.
inline void expect_whole_or_not_at_all(const Scratch& scratch, const std::filesystem::path& plain) {
  MeshFile file = read_mesh_file(plain);
  move_nodes(file.mesh);
  expect_whole_or_not_at_all(scratch, "full" + plain.extension().string(), file);
}

}  // namespace meshsmooth::formats::test

// Where results go: links, permissions, pipes, full disks.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "full_disk.hpp"
#include "generate/generate.hpp"
#include "output_files.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::error_of;
using test::expect_whole_or_not_at_all;
using test::fixture;
using test::FullDisk;
using test::put_bytes;
using test::Scratch;
using ::testing::HasSubstr;

const MeshFile& mesh_file() {
  static const MeshFile file(generate_sphere(60, 1));
  return file;
}

struct ::stat status_of(const fs::path& path) {
  struct ::stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0);
  return status;
}

unsigned mode_of(const fs::path& path) { return status_of(path).st_mode & 07777U; }

TEST(OutputFiles, AreWrittenThroughLinks) {
  const Scratch scratch;
  fs::create_directory(scratch.path("data"));
  const auto real = scratch.path("data/real.obj");
  put_bytes(real, "old");
  fs::create_symlink("data/second.obj", scratch.path("first.obj"));
  fs::create_symlink("real.obj", scratch.path("data/second.obj"));

  write_mesh_file(scratch.path("first.obj"), mesh_file());

  EXPECT_TRUE(fs::is_symlink(scratch.path("first.obj")));
  EXPECT_TRUE(fs::is_symlink(scratch.path("data/second.obj")));
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(real)));
  EXPECT_EQ(read_mesh_file(real).mesh.node_count(), mesh_file().mesh.node_count());
  EXPECT_EQ(scratch.file_count(), 2U);
}

TEST(OutputFiles, MakeTheFileThatALinkLeadsTo) {
  const Scratch scratch;
  fs::create_symlink("new.obj", scratch.path("link.obj"));

  write_mesh_file(scratch.path("link.obj"), mesh_file());

  EXPECT_EQ(fs::read_symlink(scratch.path("link.obj")), "new.obj");
  EXPECT_TRUE(fs::is_regular_file(scratch.path("new.obj")));
}

TEST(OutputFiles, RefuseLinksThatLeadNowhere) {
  const Scratch scratch;
  fs::create_symlink("b.obj", scratch.path("a.obj"));
  fs::create_symlink("a.obj", scratch.path("b.obj"));
  fs::create_symlink("no/folder.obj", scratch.path("c.obj"));
  fs::create_symlink(".", scratch.path("d.obj"));
  for (const char* name : {"a.obj", "c.obj", "d.obj"}) {
    EXPECT_EQ(error_of([&] { check_writable(scratch.path(name)); }).first, "FILE_NOT_WRITABLE")
        << name;
    EXPECT_EQ(error_of([&] { write_mesh_file(scratch.path(name), mesh_file()); }).first,
              "FILE_NOT_WRITABLE")
        << name;
  }
}

TEST(OutputFiles, OfAPairFollowALinkEach) {
  const Scratch scratch;
  fs::create_directory(scratch.path("data"));
  fs::create_symlink("data/mesh.node", scratch.path("a.node"));
  const MeshFile file = read_mesh_file(fixture("tetgen.node"));

  write_mesh_file(scratch.path("a.ele"), file);

  EXPECT_EQ(bytes_of(scratch.path("data/mesh.node")), bytes_of(fixture("tetgen.node")));
  EXPECT_EQ(bytes_of(scratch.path("a.ele")), bytes_of(fixture("tetgen.ele")));
}

TEST(OutputFiles, KeepThePermissionsOfTheFileThatTheyReplace) {
  const Scratch scratch;
  const mode_t mask = ::umask(027);
  for (const unsigned mode : {0600U, 0640U, 0664U, 0777U}) {
    for (const char* name : {"a.obj", "a.obj.gz"}) {
      put_bytes(scratch.path(name), "old");
      ASSERT_EQ(::chmod(scratch.path(name).c_str(), mode), 0);
      write_mesh_file(scratch.path(name), mesh_file());
      EXPECT_EQ(mode_of(scratch.path(name)), mode) << name;
    }
  }
  for (const char* name : {"new.obj", "new.obj.gz"}) {
    write_mesh_file(scratch.path(name), mesh_file());
    EXPECT_EQ(mode_of(scratch.path(name)), 0640U) << name;
  }
  ::umask(mask);
}

TEST(OutputFiles, KeepOwnerAndGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  const Scratch scratch;
  put_bytes(scratch.path("a.obj"), "old");
  ASSERT_EQ(::chown(scratch.path("a.obj").c_str(), 12345, 23456), 0);

  write_mesh_file(scratch.path("a.obj"), mesh_file());

  EXPECT_EQ(status_of(scratch.path("a.obj")).st_uid, 12345U);
  EXPECT_EQ(status_of(scratch.path("a.obj")).st_gid, 23456U);
}

TEST(OutputFiles, LeaveOtherNamesOfTheOldFileAlone) {
  const Scratch scratch;
  put_bytes(scratch.path("a.obj"), "old");
  fs::create_hard_link(scratch.path("a.obj"), scratch.path("b.obj"));

  write_mesh_file(scratch.path("a.obj"), mesh_file());

  EXPECT_EQ(bytes_of(scratch.path("b.obj")), "old");
}

TEST(OutputFiles, GoIntoAPipeAsAWhole) {
  const Scratch scratch;
  const auto pipe = scratch.path("pipe.obj");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::string received;
  std::jthread reader([&] { received = bytes_of(pipe); });
  write_mesh_file(pipe, mesh_file());
  reader.join();
  write_mesh_file(scratch.path("file.obj"), mesh_file());

  EXPECT_EQ(received, bytes_of(scratch.path("file.obj")));
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(scratch.file_count(), 2U);
}

TEST(OutputFiles, GoToDevicesInTheFormatThatIsNamed) {
  EXPECT_EQ(error_of([] { write_mesh_file("/dev/null", mesh_file()); }).first, "FORMAT_UNKNOWN");
  EXPECT_EQ(error_of([] { write_mesh_file("/dev/null", mesh_file(), "ply"); }).second, "no error");
  EXPECT_EQ(error_of([] { write_mesh_file("/dev/full", mesh_file(), ".ply"); }).first,
            "FILE_NOT_WRITABLE");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(OutputFiles, AreWholeOrNotThereOnAFullDisk) {
  const Scratch scratch;
  for (const char* name : {"a.obj", "a.ply", "a.obj.gz"}) {
    expect_whole_or_not_at_all(scratch, name, mesh_file());
  }
  expect_whole_or_not_at_all(scratch, "a.su2", read_mesh_file(fixture("mixed.su2")));
  expect_whole_or_not_at_all(scratch, "a.inp", read_mesh_file(fixture("deck.inp")));
}

TEST(OutputFiles, OfSeveralFilesAreAllWholeOrNotThereOnAFullDisk) {
  const Scratch scratch;
  const MeshFile file = read_mesh_file(fixture("tetgen.node"));
  const auto size = [](const char* name) { return fs::file_size(fixture(name)); };
  for (const auto limit : {size("tetgen.node") - 1, size("tetgen.ele") - 1}) {
    const FullDisk disk(limit);
    EXPECT_EQ(error_of([&] { write_mesh_file(scratch.path("a.node"), file); }).first,
              "FILE_NOT_WRITABLE");
    EXPECT_EQ(scratch.file_count(), 0U);
  }
}

}  // namespace
}  // namespace meshsmooth::formats

#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "scratch.hpp"

namespace meshsmooth::formats::test {

/// While it lives, no file of this process grows beyond `bytes`: writing fails as on a full disk,
/// but for the text of the error.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

/// However little does not fit, an error tells of it, the old file stays and no other is left.
inline void expect_whole_or_not_at_all(const Scratch& scratch, const std::string& name,
                                       const MeshFile& file) {
  const auto path = scratch.path(name);
  const std::size_t files_before = scratch.file_count();
  write_mesh_file(path, file);
  const std::size_t size = std::filesystem::file_size(path);
  std::filesystem::remove(path);
  for (const std::size_t missing : {std::size_t{1}, std::size_t{100}, size / 2, size - 1}) {
    if (missing >= size) continue;
    SCOPED_TRACE(name + ": " + std::to_string(missing) + " of " + std::to_string(size) +
                 " bytes do not fit");
    for (const bool exists : {false, true}) {
      if (exists) put_bytes(path, "old");
      std::pair<std::string, std::string> error;
      {
        const FullDisk disk(size - missing);
        error = error_of([&] { write_mesh_file(path, file); });
      }
      EXPECT_EQ(error.first, "FILE_NOT_WRITABLE");
      EXPECT_TRUE(error.second.starts_with(path.string() + ": ")) << error.second;
      EXPECT_EQ(scratch.file_count(), files_before + (exists ? 1 : 0));
      EXPECT_EQ(bytes_of(path), exists ? "old" : "");
    }
    std::filesystem::remove(path);
  }
}

}  // namespace meshsmooth::formats::test

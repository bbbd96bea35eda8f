#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>

namespace meshsmooth::formats {

/// Where an output goes: a file that is replaced by renaming, or a pipe or device that is written
/// to.
struct OutputTarget {
  /// Behind all symbolic links; need not be there.
  std::filesystem::path place;
  bool is_stream = false;
  int descriptor = -1;                    // of a stream that this process has open
  std::optional<struct ::stat> replaced;  // the file that is there
};

/// Follows links, also to a file that is not there. Throws FILE_NOT_WRITABLE: a folder, a block
/// device, links in a circle.
[[nodiscard]] OutputTarget find_output_target(const std::filesystem::path& path);

/// Throws FILE_NOT_WRITABLE unless what a path names can be replaced or written to, or made where
/// there is nothing.
void check_replaceable(const std::filesystem::path& path);
/// The same, and that a file can be made in its folder.
void check_output(const std::filesystem::path& path);

/// Throws FILE_NOT_WRITABLE, about `path`, unless files can be made in a folder.
void check_folder(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Gives a file the permissions of the one that it is to replace, its group, and its owner where
/// this user may. Throws FILE_NOT_WRITABLE.
void keep_permissions(const std::filesystem::path& path, const struct ::stat& replaced);

}  // namespace meshsmooth::formats

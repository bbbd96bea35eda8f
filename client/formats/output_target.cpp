#include "output_target.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "file_bytes.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr int kMostLinks = 40;  // as Linux follows

/// False where there is nothing.
bool find_status(const path& file, struct ::stat& status) {
  if (::stat(file.c_str(), &status) == 0) return true;
  if (errno == ENOENT || errno == ENOTDIR) return false;
  fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
}

path folder_of(const path& file) { return file.has_parent_path() ? file.parent_path() : path("."); }

}  // namespace

OutputTarget find_output_target(const path& given) {
  OutputTarget target;
  target.place = given;
  if (given == kStandardStream) {
    target.is_stream = true;
    target.descriptor = STDOUT_FILENO;
    return target;
  }
  std::error_code error;
  for (int links = 0;; ++links) {
    // What these links lead to may have no name, or be half written by others: it is not replaced.
    target.descriptor = descriptor_of(target.place);
    if (target.descriptor >= 0) {
      target.is_stream = true;
      return target;
    }
    if (!std::filesystem::is_symlink(target.place, error)) break;
    if (links == kMostLinks) fail("FILE_NOT_WRITABLE", given, std::strerror(ELOOP));
    target.place = target.place.parent_path() / std::filesystem::read_symlink(target.place, error);
  }
  struct ::stat status {};
  if (!find_status(target.place, status)) return target;
  if (S_ISDIR(status.st_mode)) fail("FILE_NOT_WRITABLE", given, "this is a folder");
  if (S_ISBLK(status.st_mode)) fail("FILE_NOT_WRITABLE", given, "this is a block device");
  target.is_stream = !S_ISREG(status.st_mode);
  if (!target.is_stream) target.replaced = status;
  return target;
}

void check_replaceable(const path& file) {
  const OutputTarget target = find_output_target(file);
  const bool exists = target.replaced || (target.is_stream && target.descriptor < 0);
  if (exists && ::access(target.place.c_str(), W_OK) != 0) {
    fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
  }
}

void check_folder(const path& file, const path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    fail("FILE_NOT_WRITABLE", file, "there is no folder " + folder.string());
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    fail("FILE_NOT_WRITABLE", file, "folder " + folder.string() + ": " + std::strerror(errno));
  }
}

void check_output(const path& file) {
  check_replaceable(file);
  const OutputTarget target = find_output_target(file);
  if (!target.is_stream) check_folder(file, folder_of(target.place));
}

void keep_permissions(const path& file, const struct ::stat& replaced) {
  const FileDescriptor open = open_to_read(file);
  mode_t mode = replaced.st_mode & 0777;
  const bool all_kept = ::fchown(open.number(), replaced.st_uid, replaced.st_gid) == 0;
  if (!all_kept && ::fchown(open.number(), static_cast<uid_t>(-1), replaced.st_gid) != 0) {
    // Another group must not get what the old one was allowed.
    const mode_t others = mode & 07;
    mode = (mode & 0707) | (mode & (others << 3));
  }
  if (::fchmod(open.number(), mode) != 0) fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
}

}  // namespace meshsmooth::formats

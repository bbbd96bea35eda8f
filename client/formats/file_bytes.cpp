#include "file_bytes.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "gzip.hpp"
#include "self_contained.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr std::size_t kChunk = std::size_t{1} << 18;
constexpr std::size_t kLeast = 4096;  // some regular files say that they are empty

/// Without the compression.
std::string read_all(const path& file) {
  const FileDescriptor source = open_to_read(file);
  struct stat status {};
  const bool regular = ::fstat(source.number(), &status) == 0 && S_ISREG(status.st_mode);
  std::string bytes;
  // One byte more than the file has: the call that fills it tells of the end.
  const std::size_t space = regular ? static_cast<std::size_t>(status.st_size) + 1 : kChunk;
  std::size_t size = 0;
  while (true) {
    if (size == bytes.size()) bytes.resize(std::max({space, kLeast, 2 * bytes.size()}));
    const std::size_t count = source.read(bytes.data() + size, bytes.size() - size, file);
    if (count == 0) break;
    size += count;
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (number_ >= 0 && owned_) ::close(number_);
}

std::size_t FileDescriptor::read(char* to, std::size_t count, const path& file) const {
  while (true) {
    const ssize_t result = ::read(number_, to, count);
    if (result >= 0) return static_cast<std::size_t>(result);
    if (errno != EINTR) fail("FILE_NOT_READABLE", file, std::strerror(errno));
  }
}

void FileDescriptor::write(std::string_view bytes, const path& file) const {
  while (!bytes.empty()) {
    const ssize_t result = ::write(number_, bytes.data(), bytes.size());
    if (result >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(result));
    } else if (errno != EINTR) {
      fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
    }
  }
}

void FileDescriptor::synchronize(const path& file) const {
  // Pipes and devices cannot be synchronized.
  if (::fsync(number_) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP) {
    fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
  }
}

void FileDescriptor::close(const path& file) {
  if (::close(std::exchange(number_, -1)) != 0) {
    fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
  }
}

FileDescriptor open_to_read(const path& file) {
  check_allowed(file);
  if (file == kStandardStream) return FileDescriptor(STDIN_FILENO, false);
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    fail("FILE_NOT_READABLE", file, "this is a folder");
  }
  const int number = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (number < 0) {
    if (errno == ENOENT) fail("FILE_NOT_FOUND", file, "there is no such file");
    fail("FILE_NOT_READABLE", file, std::strerror(errno));
  }
  return FileDescriptor(number);
}

FileDescriptor open_to_write(const path& file) {
  const int number = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (number < 0) fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
  return FileDescriptor(number);
}

int descriptor_of(const path& file) {
  std::error_code error;
  path name = file;
  if (file == "/dev/stdin" || file == "/dev/stdout" || file == "/dev/stderr") {
    name = std::filesystem::read_symlink(file, error);
    if (error) return -1;
  }
  const path folder = std::filesystem::canonical(name.parent_path(), error);
  const path own = std::filesystem::canonical("/proc/self/fd", error);
  if (error || folder != own) return -1;
  const std::string digits = name.filename().string();
  int number = -1;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return failure == std::errc() && end == digits.data() + digits.size() ? number : -1;
}

path output_name(const path& file) {
  return file == kStandardStream ? path("standard output") : file;
}

bool is_standard_output(const path& file) {
  return file == kStandardStream || descriptor_of(file) == STDOUT_FILENO;
}

bool is_standard_input(const path& file) {
  return file == kStandardStream || descriptor_of(file) == STDIN_FILENO;
}

bool is_pipe(const path& file) {
  if (file == kStandardStream || descriptor_of(file) >= 0) return true;
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
         !std::filesystem::is_directory(status);
}

std::string read_bytes(const path& file) {
  std::string bytes = read_all(file);
  if (is_gzip(bytes)) return decompress_gzip(file, bytes);
  if (is_gzip_name(file) && !bytes.empty()) {
    fail("FORMAT_ERROR", file, "its name says gzip, but it is not compressed so; rename it");
  }
  return bytes;
}

void write_bytes(const path& file, std::string_view bytes) {
  FileDescriptor target = open_to_write(file);
  target.write(bytes, file);
  target.close(file);
}

}  // namespace meshsmooth::formats

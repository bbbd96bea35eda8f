#include "work_folder.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "meshsmooth-gateway-";
constexpr const char* kLock = "lock";

[[noreturn]] void fail_to_write() {
  // Without the path, which is nobody's business but the operator's.
  throw Problem(
      "FILE_NOT_WRITABLE",
      std::string("the gateway cannot store the files of a request: ") + std::strerror(errno));
}

/// An open file that is locked; -1: another process has it, or it is not there.
int lock_file(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | flags, 0600);
  if (file >= 0 && ::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  if (file >= 0) ::close(file);
  return -1;
}

/// Those whose lock nobody holds were left behind.
void remove_left_folders(const fs::path& parent) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(parent, error)) {
    if (!entry.path().filename().string().starts_with(kPrefix)) continue;
    struct stat status {};
    // Of this user alone: others' would only be errors.
    if (::lstat(entry.path().c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
        status.st_uid != ::geteuid()) {
      continue;
    }
    const int lock = lock_file(entry.path() / kLock, 0);
    if (lock < 0) continue;
    fs::remove_all(entry.path(), error);
    ::close(lock);
  }
}

}  // namespace

WorkFolder::WorkFolder(const fs::path& given) {
  const fs::path parent = given.empty() ? fs::temp_directory_path() : fs::absolute(given);
  fs::create_directories(parent);
  remove_left_folders(parent);
  std::string name = (parent / (std::string(kPrefix) + "XXXXXX")).string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw std::system_error(errno, std::generic_category(),
                            "cannot make a folder in " + parent.string());
  }
  path_ = name;
  lock_ = lock_file(path_ / kLock, O_CREAT);
}

WorkFolder::~WorkFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
  if (lock_ >= 0) ::close(lock_);
}

RequestFolder::RequestFolder(WorkFolder& work) : path_(work.next()) {
  if (::mkdir(path_.c_str(), 0700) != 0) fail_to_write();
}

RequestFolder::~RequestFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

NewFile::NewFile(const fs::path& path)
    : number_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600)) {
  if (number_ < 0) fail_to_write();
}

NewFile::NewFile(NewFile&& other) noexcept : number_(std::exchange(other.number_, -1)) {}

void NewFile::write(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::write(number_, bytes.data(), bytes.size());
    if (count >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      fail_to_write();
    }
  }
}

void NewFile::close() {
  if (number_ >= 0) ::close(std::exchange(number_, -1));
}

OpenFile::OpenFile(const fs::path& path)
    : number_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)) {
  struct stat status {};
  if (number_ < 0 || ::fstat(number_, &status) != 0) {
    if (number_ >= 0) ::close(number_);
    throw Problem("FILE_NOT_READABLE",
                  std::string("the gateway cannot read its result: ") + std::strerror(errno));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

OpenFile::~OpenFile() { ::close(number_); }

std::size_t OpenFile::read(char* to, std::size_t count, std::uint64_t offset) const {
  while (true) {
    const ssize_t result = ::pread(number_, to, count, static_cast<off_t>(offset));
    if (result >= 0) return static_cast<std::size_t>(result);
    if (errno != EINTR) return 0;
  }
}

}  // namespace meshsmooth::gateway

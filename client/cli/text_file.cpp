#include "text_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& cause) {
  throw Error("FILE_NOT_WRITABLE", path.string() + ": cannot be written: " + cause,
              {{"path", path.string()}});
}

/// A name beside `path`, so that the rename stays in one file system.
fs::path temporary_beside(const fs::path& path) {
  return path.parent_path() / fmt::format(".{}.{}.part", path.filename().string(), ::getpid());
}

/// Writes all of it beside `path`. Errors name `path`.
fs::path write_temporary(const fs::path& path, std::string_view text) {
  const fs::path temporary = temporary_beside(path);
  errno = 0;
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  std::error_code ignored;
  if (!stream) {
    const int cause = errno;
    fs::remove(temporary, ignored);
    fail(path, cause != 0 ? std::strerror(cause) : "unknown cause");
  }
  return temporary;
}

}  // namespace

void check_text_file_writable(const fs::path& path) {
  if (fs::is_directory(path)) fail(path, "it is a folder");
  fs::remove(write_temporary(path, ""));
}

void write_text_file(const fs::path& path, std::string_view text) {
  const fs::path temporary = write_temporary(path, text);
  std::error_code error, ignored;
  fs::rename(temporary, path, error);
  if (error) {
    fs::remove(temporary, ignored);
    fail(path, error.message());
  }
}

}  // namespace meshsmooth::cli

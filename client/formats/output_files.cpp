#include "output_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "file_bytes.hpp"
#include "gzip.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// A file with nothing in it that nobody else can read, in place of one that an earlier run left.
void make_private(const path& file) {
  ::unlink(file.c_str());
  const int number = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (number < 0) fail("FILE_NOT_WRITABLE", file, std::strerror(errno));
  ::close(number);
}

void copy_to_stream(const path& from, const OutputTarget& target, const path& name) {
  const FileDescriptor source = open_to_read(from);
  const bool is_open = target.descriptor >= 0;
  const int number =
      is_open ? target.descriptor : ::open(target.place.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  if (number < 0) fail("FILE_NOT_WRITABLE", name, std::strerror(errno));
  FileDescriptor stream(number, !is_open);
  std::string bytes(std::size_t{1} << 18, '\0');
  while (const std::size_t count = source.read(bytes.data(), bytes.size(), from)) {
    stream.write(std::string_view(bytes).substr(0, count), name);
  }
  if (!is_open) stream.close(name);
}

}  // namespace

OutputFiles::~OutputFiles() {
  std::error_code ignored;
  for (const File& file : files_) std::filesystem::remove(file.partial, ignored);
}

path OutputFiles::add(const path& name) {
  const bool is_compressed = is_gzip_name(name);
  File file{.partial = {},
            .name = name,
            .target = find_output_target(name),
            .is_compressed = is_compressed};
  const path& place = file.target.place;
  path folder = place.parent_path();
  if (file.target.is_stream) {
    if (!folder_) folder_.emplace();
    folder = folder_->path();
  } else if (!folder.empty()) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) fail("FILE_NOT_WRITABLE", folder, error.message());
  }
  path partial = ".";
  partial += (is_compressed ? place.stem() : place).stem();
  partial += ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(files_.size());
  partial += !main_extension_.empty() && name == main_ ? main_extension_ : extension_of(name);
  file.partial = folder / partial;
  if (file.target.replaced) make_private(file.partial);
  return files_.emplace_back(std::move(file)).partial;
}

path OutputFiles::add_as_it_is(const path& name) {
  path partial = add(name);
  files_.back().is_compressed = false;
  return partial;
}

/// Compresses what is to be, and sees to it that the file is complete on its disk.
void OutputFiles::prepare(File& file) {
  if (file.is_compressed) {
    path packed = file.partial;
    packed += ".gz";
    if (file.target.replaced) make_private(packed);
    std::error_code ignored;
    try {
      compress_gzip(file.partial, packed);
    } catch (...) {
      std::filesystem::remove(packed, ignored);
      throw;
    }
    std::filesystem::remove(file.partial, ignored);
    file.partial = std::move(packed);
  }
  if (file.target.is_stream) return;
  if (file.target.replaced) keep_permissions(file.partial, *file.target.replaced);
  open_to_read(file.partial).synchronize(file.partial);
}

void OutputFiles::place(const File& file) {
  if (file.target.is_stream) {
    copy_to_stream(file.partial, file.target, output_name(file.name));
    return;
  }
  std::error_code error;
  std::filesystem::rename(file.partial, file.target.place, error);
  if (error) fail("FILE_NOT_WRITABLE", file.name, error.message());
}

void OutputFiles::commit() try {
  for (File& file : files_) prepare(file);
  for (const File& file : files_) place(file);
  folder_.reset();
  files_.clear();
} catch (const Error& failure) {
  throw Error(failure.reason(), with_caller_names(failure.what()));
}

std::string OutputFiles::with_caller_names(std::string text) const {
  for (const File& file : files_) {
    text = replaced(std::move(text), file.partial.string(), output_name(file.name).string());
  }
  return text;
}

}  // namespace meshsmooth::formats

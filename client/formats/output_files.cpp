#include "output_files.hpp"

#include <unistd.h>

#include "text.hpp"

namespace meshsmooth::formats {

using std::filesystem::path;

OutputFiles::~OutputFiles() {
  std::error_code ignored;
  for (const auto& [partial, target] : files_) std::filesystem::remove(partial, ignored);
}

path OutputFiles::add(const path& target) {
  std::error_code error;
  if (target.has_parent_path()) {
    std::filesystem::create_directories(target.parent_path(), error);
    if (error) fail("FILE_NOT_WRITABLE", target.parent_path(), error.message());
  }
  path name = ".";
  name += target.stem();
  name += ".partial-" + std::to_string(::getpid());
  name += target.extension();
  files_.emplace_back(target.parent_path() / name, target);
  return files_.back().first;
}

void OutputFiles::commit() {
  for (const auto& [partial, target] : files_) {
    std::error_code error;
    std::filesystem::rename(partial, target, error);
    if (error) fail("FILE_NOT_WRITABLE", target, error.message());
  }
  files_.clear();
}

std::string OutputFiles::without_partial_name(std::string text) const {
  for (const auto& [partial, target] : files_) {
    const std::string name = partial.string() + ": ";
    if (text.starts_with(name)) return text.erase(0, name.size());
  }
  return text;
}

}  // namespace meshsmooth::formats

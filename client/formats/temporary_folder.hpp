#pragma once

#include <stdlib.h>

#include <filesystem>
#include <string>

#include "text.hpp"

namespace meshsmooth::formats {

/// A folder that is removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "meshsmooth-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      fail("FILE_NOT_WRITABLE", name, "cannot make a temporary folder");
    }
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace meshsmooth::formats {

/// The files that a writer makes. Each is written under a name beside its own and renamed when all
/// are complete; what was not renamed is removed at the end.
class OutputFiles {
 public:
  OutputFiles() = default;
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// The name to write `target` under until `commit`: in the same folder, so that renaming stays
  /// inside one file system, and with the same extension, because libraries choose the format by
  /// it. Makes the folder where there is none. Throws FILE_NOT_WRITABLE.
  [[nodiscard]] std::filesystem::path add(const std::filesystem::path& target);
  /// Gives all files their names, in the order in which they were added. Throws FILE_NOT_WRITABLE.
  void commit();
  /// An error's text without the name of an unfinished file in front: "NAME: what".
  [[nodiscard]] std::string without_partial_name(std::string text) const;

 private:
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> files_;  // partial, target
};

}  // namespace meshsmooth::formats

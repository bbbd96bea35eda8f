#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output_target.hpp"
#include "temporary_folder.hpp"

namespace meshsmooth::formats {

/// The files that a writer makes. Each is written under a name beside its own and renamed when all
/// are complete; what was not renamed is removed at the end. Symbolic links stay and lead to the
/// new file, which has the permissions of the one that it replaces. Files whose names end in ".gz"
/// are compressed; pipes and devices get all bytes at last.
class OutputFiles {
 public:
  OutputFiles() = default;
  /// `main` is written under a name with this extension, ".vtu", whatever its own is.
  OutputFiles(std::filesystem::path main, std::string extension)
      : main_(std::move(main)), main_extension_(std::move(extension)) {}
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// The name to write `target` under until `commit`: in the same folder, so that renaming stays
  /// inside one file system, and with the extension of its format, because libraries choose the
  /// format by it. Makes the folder where there is none. Throws FILE_NOT_WRITABLE.
  [[nodiscard]] std::filesystem::path add(const std::filesystem::path& target);
  /// The same for what is written as it shall be, be it compressed or not.
  [[nodiscard]] std::filesystem::path add_as_it_is(const std::filesystem::path& target);
  /// Gives all files their names, in the order in which they were added. Throws FILE_NOT_WRITABLE.
  void commit();
  /// An error's text with the caller's names of the files.
  [[nodiscard]] std::string with_caller_names(std::string text) const;

 private:
  struct File {
    std::filesystem::path partial;
    std::filesystem::path name;  // the caller's
    OutputTarget target;
    bool is_compressed;
  };
  static void prepare(File& file);
  static void place(const File& file);

  std::filesystem::path main_;
  std::string main_extension_;
  std::vector<File> files_;
  std::optional<TemporaryFolder> folder_;  // for what goes to a pipe or device
};

}  // namespace meshsmooth::formats

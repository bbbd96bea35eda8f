#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace meshsmooth::formats {

/// An HDF5 file, read or changed by the paths of its objects ("/group/dataset"). It never opens
/// another file: external links, external storage and virtual datasets are refused.
///
/// Every call throws `Error` that names the file and the object: FILE_TRUNCATED, FORMAT_ERROR.
/// No array is larger than the file could hold.
class Hdf5File {
 public:
  /// To be changed on the disk.
  explicit Hdf5File(std::filesystem::path path);
  /// To be read, from a copy of `bytes`; `path` is for messages only.
  Hdf5File(std::filesystem::path path, const std::string& bytes);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  /// Fails where any object of the file has its data in another file: for files that another
  /// library reads then.
  void check_own_data() const;

  [[nodiscard]] bool has(const std::string& object) const;
  /// The names in a group, ascending.
  [[nodiscard]] std::vector<std::string> children(const std::string& group) const;

  /// All numbers of a dataset, whatever its shape.
  [[nodiscard]] std::vector<double> reals(const std::string& dataset) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& dataset) const;
  /// The bytes of a dataset of characters or of strings of one length.
  [[nodiscard]] std::string text(const std::string& dataset) const;
  [[nodiscard]] bool is_single_precision(const std::string& dataset) const;
  [[nodiscard]] bool is_whole(const std::string& dataset) const;
  [[nodiscard]] std::vector<std::size_t> shape(const std::string& dataset) const;

  /// Up to its first NUL; empty where the object has no such text.
  [[nodiscard]] std::string text_attribute(const std::string& object,
                                           const std::string& name) const;
  [[nodiscard]] std::optional<std::int64_t> integer_attribute(const std::string& object,
                                                              const std::string& name) const;

  /// Replaces all numbers of a dataset of reals, in its own type.
  void overwrite(const std::string& dataset, std::span<const double> values);
  /// Also writes what HDF5 still has in memory.
  void close();

  [[noreturn]] void fail(const std::string& what) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::formats

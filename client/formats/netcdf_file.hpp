#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace meshsmooth::formats {

/// A netCDF file on the disk, of any of its formats: classic, 64-bit offset, 64-bit data, HDF5.
///
/// Every call throws `Error` that names the file and the variable: FILE_TRUNCATED, FORMAT_ERROR,
/// FILE_NOT_WRITABLE. No array is larger than the file could hold.
class NetcdfFile {
 public:
  enum class Access { read, change };
  NetcdfFile(std::filesystem::path path, Access access);
  ~NetcdfFile();
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  /// None: there is no such dimension.
  [[nodiscard]] std::optional<std::size_t> dimension(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& variable) const;
  /// The k, ascending, of the variables "NAMEk" that there are. O(variables), whatever number of
  /// them the file claims.
  [[nodiscard]] std::vector<std::size_t> numbers_behind(const std::string& name) const;
  /// The same of dimensions.
  [[nodiscard]] std::vector<std::size_t> dimension_numbers(const std::string& name) const;
  [[nodiscard]] std::vector<double> reals(const std::string& variable) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& variable) const;
  /// The rows of a variable of characters with two dimensions, without what pads them; none
  /// where there is no such variable.
  [[nodiscard]] std::vector<std::string> rows(const std::string& variable) const;
  [[nodiscard]] std::string text_attribute(const std::string& variable,
                                           const std::string& name) const;
  [[nodiscard]] bool is_single_precision(const std::string& variable) const;
  [[nodiscard]] std::vector<std::size_t> shape(const std::string& variable) const {
    return shape(find(variable), variable);
  }

  /// Replaces all numbers of a variable, in its own type.
  void overwrite(const std::string& variable, std::span<const double> values);
  void close();

  [[noreturn]] void fail(const std::string& what) const;

 private:
  [[nodiscard]] int find(const std::string& variable) const;
  [[nodiscard]] std::vector<std::size_t> shape(int id, const std::string& variable) const;
  [[nodiscard]] std::size_t count(int id, const std::string& variable) const;
  void check(int status, const std::string& what) const;

  std::filesystem::path path_;
  std::uintmax_t size_;
  int file_ = -1;
};

}  // namespace meshsmooth::formats

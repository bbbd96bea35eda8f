#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace meshsmooth::cli {

/// NumPy's format of named arrays: a zip archive (stored, with 64-bit sizes) of .npy files of
/// version 1.0, for numpy.load.
class NpzFile {
 public:
  void add(std::string_view name, std::span<const std::int64_t> values) {
    add(name, "<i8", {values.size()}, values.data(), values.size_bytes());
  }
  void add(std::string_view name, std::span<const std::uint8_t> values) {
    add(name, "|u1", {values.size()}, values.data(), values.size_bytes());
  }
  /// `columns` numbers a row; 1: an array of one dimension.
  void add(std::string_view name, std::span<const double> values, std::size_t columns = 1);

  /// The whole file.
  [[nodiscard]] std::string bytes() &&;

 private:
  struct Entry {
    std::string name;
    std::uint32_t checksum;
    std::uint64_t size;
    std::uint64_t offset;  // of its header
  };
  void add(std::string_view name, std::string_view type, const std::vector<std::size_t>& shape,
           const void* data, std::size_t size);

  std::string bytes_;
  std::vector<Entry> entries_;
};

}  // namespace meshsmooth::cli

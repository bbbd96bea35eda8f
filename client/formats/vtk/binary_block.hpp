#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vtk/number_block.hpp"

namespace meshsmooth::formats {

/// The bytes of a block of binary numbers, uncompressed, in the file's byte order.
struct BinaryBlock {
  std::string bytes;
  std::size_t length = 0;               // in the file
  std::size_t block_size = 0;           // of compressed blocks, but the last one
  std::vector<std::string> compressed;  // the blocks
};

/// None: the sizes in its header do not fit, or it cannot be decompressed.
[[nodiscard]] std::optional<BinaryBlock> read_binary(std::string_view file,
                                                     const NumberBlock& block);

/// As it stands in a file. Compressed blocks that do not change are taken from `before`.
[[nodiscard]] std::string write_binary(const NumberBlock& block, const BinaryBlock& before,
                                       const std::string& bytes);

/// A number in either byte order.
template <class T>
T load(const char* from, bool big_endian) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof(T)> bytes{};
  std::copy_n(from, bytes.size(), bytes.begin());
  if (big_endian) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

template <class T>
void store(char* to, T value, bool big_endian) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) std::ranges::reverse(bytes);
  std::ranges::copy(bytes, to);
}

}  // namespace meshsmooth::formats

#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace meshsmooth::formats {

/// How a number is stored.
struct NumberType {
  enum class Kind { integer, natural, real };
  Kind kind;
  std::size_t bytes;

  bool operator==(const NumberType&) const = default;
};
inline constexpr NumberType kFloat32 = {NumberType::Kind::real, 4};
inline constexpr NumberType kFloat64 = {NumberType::Kind::real, 8};

/// The numbers of one array as they stand in the bytes of a VTK file.
struct NumberBlock {
  enum class Encoding { ascii, raw, base64 };
  enum class Compressor { none, zlib, lz4, lzma };
  /// The count of a block of which only its header, or its end, says how many numbers it has.
  static constexpr std::size_t kAll = static_cast<std::size_t>(-1);

  std::size_t begin = 0;  // of the first number, or of the header before it
  std::size_t limit = 0;  // the block ends here or earlier
  std::size_t count = 0;  // of numbers
  NumberType type = kFloat64;
  Encoding encoding = Encoding::ascii;
  bool big_endian = false;
  std::size_t header_bytes = 0;  // of a word in the header before binary numbers; 0: no header
  Compressor compressor = Compressor::none;
};

/// The numbers. None where the bytes do not hold as many of them as the block should. O(block).
[[nodiscard]] std::optional<std::vector<double>> read_numbers(std::string_view file,
                                                              const NumberBlock& block);

/// Bytes of a file to be replaced.
struct Edit {
  std::size_t begin;
  std::size_t length;
  std::string bytes;
};

/// What puts other numbers in place of a block that `read_numbers` can read; as many. In text each
/// number that equals the one read keeps its digits. Where nothing changes there is no edit.
/// `type`: of the numbers from now on. O(block).
[[nodiscard]] std::vector<Edit> replace_numbers(std::string_view file, const NumberBlock& block,
                                                std::span<const double> numbers,
                                                const NumberType& type);

/// The file with the edits made, which must not overlap. Sorts them. O(file).
[[nodiscard]] std::string apply_edits(std::string_view file, std::vector<Edit>& edits);

}  // namespace meshsmooth::formats

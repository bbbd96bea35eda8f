#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "notes.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

enum class PlyKind { integer, natural, real };

struct PlyType {
  std::size_t bytes;
  PlyKind kind;
};

struct PlyProperty {
  std::string name;
  PlyType type;
  std::optional<PlyType> count;  // of a list
};

struct PlySection {
  std::string name;
  std::size_t row_count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  bool text = false;
  bool big_endian = false;
  std::vector<PlySection> sections;
};

/// From the start of a file to its first row. Throws FORMAT_ERROR, FILE_TRUNCATED.
[[nodiscard]] PlyHeader read_ply_header(Scanner& scanner, Notes& notes);

/// A number in a binary file.
[[nodiscard]] double decode_ply(std::string_view word, PlyType type, bool big_endian);

}  // namespace meshsmooth::formats

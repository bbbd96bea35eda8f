#include "ply_check.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

struct Property {
  std::size_t value_bytes;
  std::size_t count_bytes;  // 0: not a list
};

struct Section {
  std::size_t count;
  std::vector<Property> properties;
};

struct Header {
  bool text = false;
  bool big_endian = false;
  std::vector<Section> sections;
};

std::size_t type_bytes(const Scanner& scanner, std::string_view type) {
  constexpr auto kOne = std::to_array<std::string_view>({"char", "uchar", "int8", "uint8"});
  constexpr auto kTwo = std::to_array<std::string_view>({"short", "ushort", "int16", "uint16"});
  constexpr auto kFour =
      std::to_array<std::string_view>({"int", "uint", "int32", "uint32", "float", "float32"});
  const auto is_in = [&](const auto& names) {
    return std::find(names.begin(), names.end(), type) != names.end();
  };
  if (is_in(kOne)) return 1;
  if (is_in(kTwo)) return 2;
  if (is_in(kFour)) return 4;
  if (type != "double" && type != "float64") scanner.refuse("a PLY type", type);
  return 8;
}

Header read_header(const std::filesystem::path& path, Scanner& scanner) {
  Header header;
  if (const auto word = scanner.token(); word != "ply") scanner.refuse("ply", word);
  scanner.line();
  for (auto word = scanner.token(); word != "end_header"; word = scanner.token()) {
    if (word == "format") {
      const std::string_view format = scanner.token();
      header.text = format == "ascii";
      header.big_endian = format == "binary_big_endian";
    } else if (word == "element") {
      scanner.token();
      header.sections.push_back({scanner.count(), {}});
    } else if (word == "property") {
      if (header.sections.empty()) fail("FORMAT_ERROR", path, "a property of no element");
      Property property{0, 0};
      std::string_view type = scanner.token();
      if (type == "list") {
        property.count_bytes = type_bytes(scanner, scanner.token());
        type = scanner.token();
      }
      property.value_bytes = type_bytes(scanner, type);
      header.sections.back().properties.push_back(property);
    }
    scanner.line();
  }
  scanner.line();
  return header;
}

std::size_t list_length(std::string_view bytes, bool big_endian) {
  std::size_t value = 0;
  for (std::size_t place = 0; place < bytes.size(); ++place) {
    const std::size_t from = big_endian ? place : bytes.size() - 1 - place;
    value = value << 8 | static_cast<std::uint8_t>(bytes[from]);
  }
  return value;
}

void skip_row(Scanner& scanner, const Header& header, const Section& section) {
  for (const Property& property : section.properties) {
    std::size_t count = 1;
    if (property.count_bytes != 0) {
      count = header.text ? scanner.count()
                          : list_length(scanner.bytes(property.count_bytes), header.big_endian);
    }
    if (header.text) {
      for (std::size_t value = 0; value < count; ++value) scanner.number<double>();
    } else {
      scanner.bytes(count * property.value_bytes);
    }
  }
}

}  // namespace

void check_ply(const std::filesystem::path& path, std::string_view bytes) {
  Scanner scanner(path, bytes);
  const Header header = read_header(path, scanner);
  for (const Section& section : header.sections) {
    for (std::size_t row = 0; row < section.count; ++row) skip_row(scanner, header, section);
  }
}

}  // namespace meshsmooth::formats

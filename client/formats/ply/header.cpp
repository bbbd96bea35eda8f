#include "header.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>

namespace meshsmooth::formats {
namespace {

PlyType read_type(Scanner& scanner) {
  static const std::map<std::string_view, PlyType> types = {
      {"char", {1, PlyKind::integer}},   {"int8", {1, PlyKind::integer}},
      {"uchar", {1, PlyKind::natural}},  {"uint8", {1, PlyKind::natural}},
      {"short", {2, PlyKind::integer}},  {"int16", {2, PlyKind::integer}},
      {"ushort", {2, PlyKind::natural}}, {"uint16", {2, PlyKind::natural}},
      {"int", {4, PlyKind::integer}},    {"int32", {4, PlyKind::integer}},
      {"uint", {4, PlyKind::natural}},   {"uint32", {4, PlyKind::natural}},
      {"float", {4, PlyKind::real}},     {"float32", {4, PlyKind::real}},
      {"double", {8, PlyKind::real}},    {"float64", {8, PlyKind::real}}};
  const std::string_view name = scanner.token();
  const auto found = types.find(name);
  if (found == types.end()) scanner.refuse("a PLY type", name);
  return found->second;
}

template <class T>
double decode(std::string_view word, bool big_endian) {
  std::array<char, sizeof(T)> bytes{};
  std::copy_n(word.begin(), bytes.size(), bytes.begin());  // it has no other size
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<T>(bytes));
}

}  // namespace

PlyHeader read_ply_header(Scanner& scanner, Notes& notes) {
  PlyHeader header;
  bool has_vertices = false;
  if (const auto word = scanner.token(); word != "ply") scanner.refuse("ply", word);
  scanner.line();
  for (auto word = scanner.token(); word != "end_header"; word = scanner.token()) {
    if (word == "format") {
      const std::string_view format = scanner.token();
      header.text = format == "ascii";
      header.big_endian = format == "binary_big_endian";
      if (!header.text && !header.big_endian && format != "binary_little_endian") {
        scanner.refuse("a PLY format", format);
      }
    } else if (word == "element") {
      std::string name(scanner.token());
      if (name == "vertex" && has_vertices) scanner.refuse("one list of vertices", name);
      has_vertices = has_vertices || name == "vertex";
      header.sections.push_back({std::move(name), scanner.count(), {}});
    } else if (word == "property") {
      if (header.sections.empty()) scanner.refuse("element", word);
      PlyProperty property{{}, {}, std::nullopt};
      Scanner ahead = scanner;
      if (ahead.token() == "list") {
        scanner.token();
        property.count = read_type(scanner);
      }
      property.type = read_type(scanner);
      property.name = scanner.token();
      header.sections.back().properties.push_back(property);
    } else if (word != "comment" && word != "obj_info") {
      notes.add("no header line", [&] {
        return "the line of the header that starts with \"" + std::string(word) + "\" is ignored";
      });
    }
    scanner.line();
  }
  scanner.line();
  return header;
}

double decode_ply(std::string_view word, PlyType type, bool big_endian) {
  if (type.kind == PlyKind::real) {
    return type.bytes == 4 ? decode<float>(word, big_endian) : decode<double>(word, big_endian);
  }
  const bool natural = type.kind == PlyKind::natural;
  if (type.bytes == 1) {
    return natural ? decode<std::uint8_t>(word, big_endian) : decode<std::int8_t>(word, big_endian);
  }
  if (type.bytes == 2) {
    return natural ? decode<std::uint16_t>(word, big_endian)
                   : decode<std::int16_t>(word, big_endian);
  }
  return natural ? decode<std::uint32_t>(word, big_endian) : decode<std::int32_t>(word, big_endian);
}

}  // namespace meshsmooth::formats

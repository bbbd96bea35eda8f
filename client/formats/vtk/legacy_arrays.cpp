#include "vtk/legacy_arrays.hpp"

#include <cmath>
#include <cstdint>
#include <map>

#include "vtk/layout.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

using Kind = NumberType::Kind;

}  // namespace

std::string lower_case(std::string_view word) {
  std::string result(word);
  for (char& letter : result) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return result;
}

std::optional<NumberType> legacy_number_type(std::string_view lower_case_name) {
  static const std::map<std::string_view, NumberType> types = {
      {"char", {Kind::integer, 1}},
      {"signed_char", {Kind::integer, 1}},
      {"unsigned_char", {Kind::natural, 1}},
      {"short", {Kind::integer, 2}},
      {"unsigned_short", {Kind::natural, 2}},
      {"int", {Kind::integer, 4}},
      {"vtkidtype", {Kind::integer, 4}},
      {"unsigned_int", {Kind::natural, 4}},
      {"long", {Kind::integer, 8}},
      {"vtktypeint64", {Kind::integer, 8}},
      {"unsigned_long", {Kind::natural, 8}},
      {"vtktypeuint64", {Kind::natural, 8}},
      {"float", kFloat32},
      {"double", kFloat64}};
  const auto found = types.find(lower_case_name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

NumberBlock LegacyArrays::read_array(std::string_view type_name, std::size_t rows,
                                     std::size_t width) {
  const std::string name = lower_case(type_name);
  const std::size_t count = product(rows, width);
  NumberBlock block;
  if (name == "bit") {
    block = read_numbers_of({Kind::natural, 1}, binary_ ? (count + 7) / 8 : count);
  } else if (name == "string" || name == "utf8_string") {
    read_strings(count);
  } else if (name == "variant") {
    for (std::size_t place = 0; place < 2 * count; ++place) scanner_.token();
  } else if (const auto type = legacy_number_type(name)) {
    block = read_numbers_of(*type, count);
  } else {
    scanner_.refuse("a data type of legacy VTK", type_name);
  }
  skip_metadata(width);
  return block;
}

NumberBlock LegacyArrays::read_numbers_of(NumberType type, std::size_t count) {
  NumberBlock block;
  block.count = count;
  block.type = type;
  block.big_endian = true;
  if (binary_) {
    block.encoding = NumberBlock::Encoding::raw;
    if (count != 0) scanner_.line();
    block.begin = scanner_.position();
    scanner_.bytes(count * type.bytes);
  } else {
    block.begin = scanner_.position();
    for (std::size_t place = 0; place < count; ++place) check_number(scanner_.token(), type);
  }
  block.limit = scanner_.position();
  return block;
}

void LegacyArrays::read_colours(std::size_t width, std::size_t rows) {
  if (!binary_) in_colours_ = true;
  (void)read_numbers_of(binary_ ? NumberType{Kind::natural, 1} : kFloat32, product(rows, width));
  in_colours_ = false;
  skip_metadata(width);
}

std::size_t LegacyArrays::product(std::size_t rows, std::size_t width) const {
  const std::size_t most = file_.size() * 8;  // bits
  if (width != 0 && rows > most / width) {
    fail("FILE_TRUNCATED", path_,
         "the file is too short for an array of " + std::to_string(rows) + " times " +
             std::to_string(width) + " numbers");
  }
  return rows * width;
}

void LegacyArrays::check_number(std::string_view word, NumberType type) {
  const auto number = parse_number(word, type == kFloat32);
  if (!number) scanner_.refuse("a number", word);
  const bool plain = is_plain_number(word, *number);
  if (type.kind != Kind::real) {
    // The streams of C++ would take the rest of "1.5" for the next number.
    const bool whole = plain && word.find_first_of(".eE") == std::string_view::npos;
    if (!whole) scanner_.refuse("a whole number", word);
    return;
  }
  if (plain) return;
  double instead = *number;
  if (in_colours_ && !std::isfinite(instead)) {
    instead = 0;  // VTK makes bytes of them
  } else if (std::isnan(instead)) {
    instead = kInsteadOfNan;
  } else if (std::isinf(instead)) {
    instead = instead > 0 ? kInsteadOfInfinity : kInsteadOfMinusInfinity;
  }
  std::string digits;
  append_number(digits, instead, false);
  replaced_.push_back({scanner_.offset_of(word), word.size(), std::move(digits)});
}

void LegacyArrays::read_strings(std::size_t count) {
  scanner_.line();
  for (std::size_t place = 0; place < count; ++place) {
    if (!binary_) {
      if (scanner_.position() == file_.size()) scanner_.truncated();
      scanner_.line();
      continue;
    }
    Scanner ahead = scanner_;
    const auto first = static_cast<unsigned char>(ahead.bytes(1)[0]);
    std::uint64_t length = 0;
    const std::size_t width = std::size_t{1} << (3 - (first >> 6));
    for (const char byte : scanner_.bytes(width)) {
      length = length << 8 | static_cast<unsigned char>(byte);
    }
    if (width < 8) length &= (std::uint64_t{1} << (8 * width - 2)) - 1;
    scanner_.bytes(length);
  }
}

void LegacyArrays::skip_metadata(std::size_t width) {
  Scanner ahead = scanner_;
  if (ahead.at_end() || lower_case(ahead.token_on_line()) != "metadata") return;
  scanner_ = ahead;
  scanner_.line();
  while (scanner_.position() < file_.size()) {
    const std::string_view line = scanner_.line();
    if (line.empty()) return;
    if (!lower_case(line).starts_with("component_names")) continue;
    for (std::size_t name = 0; name < width; ++name) scanner_.line();
  }
}

}  // namespace meshsmooth::formats

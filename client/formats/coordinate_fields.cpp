#include "coordinate_fields.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <utility>

namespace meshsmooth::formats {
namespace {

bool is_binary(NumberStyle style) {
  return style == NumberStyle::binary || style == NumberStyle::binary_swapped;
}

template <class Real>
double copy_bits(std::string_view bytes) {
  Real value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

/// Also "1.5+3" for 1500 and a blank for 0.
double parse_deck(std::string_view word, const Scanner& scanner) {
  std::string number;
  for (const char c : word) {
    const bool sign = c == '+' || c == '-';
    if (c == ' ' || c == '\t') continue;
    if (sign && !number.empty() && number.back() != 'E') number += 'E';
    if (c == '+' && !number.empty()) continue;
    number += c == 'D' || c == 'd' || c == 'e' ? 'E' : c;
  }
  return number.empty() ? 0.0 : scanner.parse<double>(number);
}

double parse_coordinate(std::string_view word, NumberStyle style, const Scanner& scanner) {
  if (is_binary(style)) {
    std::string bytes(word);
    if (style == NumberStyle::binary_swapped) std::reverse(bytes.begin(), bytes.end());
    if (bytes.size() == sizeof(float)) return copy_bits<float>(bytes);
    return copy_bits<double>(bytes);
  }
  if (style == NumberStyle::fortran) {
    std::string text(word.substr(std::min(word.find_first_not_of(' '), word.size())));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == 'D' || c == 'd'; }, 'E');
    return scanner.parse<double>(text);
  }
  if (style == NumberStyle::deck) return parse_deck(word, scanner);
  return scanner.parse<double>(word);
}

/// "1.E-5" of "1E-05", in capitals.
std::string with_point(std::string number) {
  std::ranges::replace(number, 'e', 'E');
  const std::size_t exponent = std::min(number.find('E'), number.size());
  if (number.find('.') == std::string::npos) number.insert(exponent, 1, '.');
  if (const auto plus = number.find("E+"); plus != std::string::npos) number.erase(plus + 1, 1);
  for (const char* zero : {"E-0", "E0"}) {
    if (const auto at = number.find(zero); at != std::string::npos) {
      number.erase(at + std::strlen(zero) - 1, 1);
    }
  }
  return number;
}

/// With all digits, unless they are more than Abaqus and CalculiX read.
std::string format_deck(double value, std::string_view before) {
  constexpr std::size_t kMost = 20;
  std::array<char, 64> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  std::string number = with_point({text.data(), end});
  for (int digits = 17; number.size() > kMost; --digits) {
    std::snprintf(text.data(), text.size(), "%.*E", digits - 1, value);
    number = with_point(text.data());
  }
  if (before.find_first_of("Dd") != std::string_view::npos) {
    if (number.find('E') == std::string::npos && number.size() + 2 <= kMost) number += "E0";
    std::ranges::replace(number, 'E', 'D');
  }
  const bool blank = before.starts_with(' ') || before.starts_with('\t');
  const std::size_t width = std::max(before.size(), number.size() + (blank ? 1 : 0));
  return std::string(width - number.size(), ' ') + number;
}

/// With all digits; in a field of columns, with those that leave a blank before them.
std::string format_fortran(double value, std::string_view before) {
  const bool in_columns = before.size() == 13 || before.size() == 25 || before.starts_with(' ');
  std::array<char, 64> text{};
  for (int digits = 17; digits > 0; --digits) {
    std::snprintf(text.data(), text.size(), "%#.*E", digits - 1, value);
    std::string number = text.data();
    if (before.find_first_of("Ee") == std::string_view::npos)
      std::ranges::replace(number, 'E', 'D');
    if (in_columns && number.size() >= before.size()) continue;
    return in_columns ? std::string(before.size() - number.size(), ' ') + number : number;
  }
  return std::string(before.size(), '*');  // cannot be: "-1.E-308" has 8 columns
}

std::string format_coordinate(double value, NumberStyle style, std::string_view before) {
  const std::size_t width = before.size();
  std::array<char, 64> text{};
  if (is_binary(style)) {
    const auto single = static_cast<float>(value);
    const bool is_single = width == sizeof(float);
    std::memcpy(text.data(), is_single ? static_cast<const void*>(&single) : &value, width);
    if (style == NumberStyle::binary_swapped) std::reverse(text.begin(), text.begin() + width);
    return {text.data(), width};
  }
  if (style == NumberStyle::fortran) return format_fortran(value, before);
  if (style == NumberStyle::deck) return format_deck(value, before);
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

void CoordinateFields::add(std::int64_t node_id, std::array<std::string_view, 3> words,
                           const Scanner& scanner) {
  std::array<Field, 3> found{};
  std::array<double, 3> values{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    found[axis] = {scanner.offset_of(words[axis]), words[axis].size()};
    values[axis] = parse_coordinate(words[axis], style, scanner);
  }
  node_ids.push_back(node_id);
  fields.push_back(found);
  positions.push_back({values[0], values[1], values[2]});
}

std::string replace_coordinates(std::string_view bytes, const CoordinateFields& fields,
                                const PositionsView& positions) {
  std::string result;
  result.reserve(bytes.size() + bytes.size() / 4);
  std::size_t copied = 0;
  std::visit(
      [&](const auto& nodes) {
        for (std::size_t node = 0; node < nodes.size(); ++node) {
          const auto place = vec3_cast<double>(nodes[node]);
          const Vec3d before = fields.positions[node];
          const std::array<double, 3> now = {place.x, place.y, place.z};
          const std::array<double, 3> then = {before.x, before.y, before.z};
          std::size_t commas = 0;  // that come before the first missing field
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto& field = fields.fields[node][axis];
            commas += field.missing ? 1 : 0;
            if (same_bits(now[axis], then[axis])) continue;
            result += bytes.substr(copied, field.begin - copied);
            result.append(std::exchange(commas, 0), ',');
            result +=
                format_coordinate(now[axis], fields.style, bytes.substr(field.begin, field.length));
            copied = field.begin + field.length;
          }
        }
      },
      positions);
  result += bytes.substr(copied);
  return result;
}

}  // namespace meshsmooth::formats

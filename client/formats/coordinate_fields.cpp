#include "coordinate_fields.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstring>

namespace meshsmooth::formats {
namespace {

double parse_coordinate(std::string_view word, NumberStyle style, const Scanner& scanner) {
  if (style == NumberStyle::binary) {
    double value = 0;
    std::memcpy(&value, word.data(), sizeof value);
    return value;
  }
  if (style == NumberStyle::fortran) {
    std::string text(word);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == 'D' || c == 'd'; }, 'E');
    return scanner.parse<double>(text);
  }
  return scanner.parse<double>(word);
}

std::string format_coordinate(double value, NumberStyle style, std::size_t width) {
  std::array<char, 64> text{};
  if (style == NumberStyle::binary) {
    std::memcpy(text.data(), &value, sizeof value);
    return {text.data(), sizeof value};
  }
  if (style == NumberStyle::fortran) {
    const int length =
        std::snprintf(text.data(), text.size(), "%*.16E", static_cast<int>(width), value);
    std::replace(text.begin(), text.end(), 'E', 'D');
    return {text.data(), static_cast<std::size_t>(length)};
  }
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
          for (std::size_t axis = 0; axis < 3; ++axis) {
            if (same_bits(now[axis], then[axis])) continue;
            const auto& field = fields.fields[node][axis];
            result += bytes.substr(copied, field.begin - copied);
            result += format_coordinate(now[axis], fields.style, field.length);
            copied = field.begin + field.length;
          }
        }
      },
      positions);
  result += bytes.substr(copied);
  return result;
}

}  // namespace meshsmooth::formats

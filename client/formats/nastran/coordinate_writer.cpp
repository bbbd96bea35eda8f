#include "nastran/coordinate_writer.hpp"

#include <algorithm>
#include <array>

#include "nastran/numbers.hpp"

namespace meshsmooth::formats {
namespace {

using Field = CoordinateFields::Field;

constexpr std::size_t kAllDigits = 24;

/// "\r\n" where the lines at that place end so.
std::string_view line_end(std::string_view text, std::size_t at) {
  std::size_t end = text.find('\n', at);
  if (end == std::string_view::npos) end = text.rfind('\n');
  return end != std::string_view::npos && end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
}

/// Columns that a number between commas may take, so that its line has no more than 80: Nastran
/// reads no more.
std::size_t free_columns(std::string_view text, const std::array<Field, 3>& fields) {
  constexpr std::size_t kLine = 80;
  constexpr std::size_t kLeast = 8;
  const std::size_t before = text.rfind('\n', fields[0].begin);
  const std::size_t begin =
      before == std::string_view::npos || fields[0].begin == 0 ? 0 : before + 1;
  const std::size_t end = std::min(text.find_first_of("\r\n$", fields[0].begin), text.size());
  std::size_t others = end - begin;
  std::size_t numbers = 0;
  for (const Field& field : fields) {
    if (field.begin > end || field.in_next_line) continue;
    ++numbers;
    others -= std::min(others, field.length);
    others += field.missing ? 1 : 0;
  }
  const std::size_t left = (kLine - std::min(others, kLine)) / std::max<std::size_t>(numbers, 1);
  return std::clamp(left, kLeast, kAllDigits);
}

/// In its columns, on the side on which the number was before.
std::string in_columns(double value, const Field& field, std::string_view before) {
  const std::size_t columns = field.columns;
  std::string number = format_nastran_real(value, std::min(columns, std::size_t{field.digits}));
  const std::size_t blanks = columns - std::min(number.size(), columns);
  const bool right = before.size() == columns && before.front() == ' ' && before.back() != ' ' &&
                     before.back() != '\t';
  return right ? std::string(blanks, ' ') + number : number + std::string(blanks, ' ');
}

/// The fields of one node.
class NodeWriter {
 public:
  NodeWriter(std::string_view text, const std::array<Field, 3>& fields)
      : text_(text), fields_(fields) {}

  /// What takes the place of a field; to be called in the order of the axes.
  std::string text_of(std::size_t axis, double value) {
    const Field& field = fields_[axis];
    std::string result;
    if (field.missing && field.in_next_line) {
      result.append(line_end(text_, field.begin)).append(field.columns == 0 ? "*," : "*       ");
    } else if (field.missing) {
      if (field.begin != end_) written_ = 0;
      const std::size_t lead = field.lead - std::min<std::size_t>(field.lead, written_);
      result.append(lead, field.columns == 0 ? ',' : ' ');
      written_ = field.lead + std::size_t{field.columns};
    } else if (field.columns > 0) {
      written_ = field.columns - field.length;
    }
    end_ = field.begin + field.length;
    if (field.columns > 0) {
      return result + in_columns(value, field, text_.substr(field.begin, field.length));
    }
    if (columns_ == 0) columns_ = free_columns(text_, fields_);
    const std::size_t columns = field.in_next_line ? kAllDigits : std::max(columns_, field.length);
    return result + format_nastran_real(value, std::min(columns, std::size_t{field.digits}));
  }

 private:
  std::string_view text_;
  const std::array<Field, 3>& fields_;
  std::size_t written_ = 0;  // columns or commas more than there were, before ...
  std::size_t end_ = 0;      // ... the end of the last field that was written
  std::size_t columns_ = 0;  // between commas, when they are known
};

}  // namespace

std::string replace_nastran_coordinates(const TextSegment& segment,
                                        std::span<const Vec3d> positions) {
  const std::string_view text = segment.text;
  std::string result;
  result.reserve(text.size() + text.size() / 8);
  std::size_t copied = 0;
  for (std::size_t place = 0; place < segment.nodes.size(); ++place) {
    const Vec3d& to = positions[static_cast<std::size_t>(segment.nodes[place])];
    const Vec3d& from = segment.fields.positions[place];
    if (to == from) continue;
    const std::array<double, 3> now = {to.x, to.y, to.z};
    const std::array<double, 3> then = {from.x, from.y, from.z};
    const std::array<Field, 3>& fields = segment.fields.fields[place];
    NodeWriter writer(text, fields);
    for (std::size_t axis = 0; axis < fields.size(); ++axis) {
      if (now[axis] == then[axis]) continue;  // also a zero of the other sign
      result += text.substr(copied, fields[axis].begin - copied);
      result += writer.text_of(axis, now[axis]);
      copied = fields[axis].begin + fields[axis].length;
    }
  }
  return result += text.substr(copied);
}

}  // namespace meshsmooth::formats

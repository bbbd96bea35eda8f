#include "unv/nodes.hpp"

#include <algorithm>
#include <string>

namespace meshsmooth::formats::unv {
namespace {

using Coordinates = std::array<std::string_view, 3>;

/// Fields in columns are taken whole, with their blanks: `NumberStyle::fortran` writes a number
/// into them that does not spill. Other numbers are bare words.
Coordinates find_coordinates(const Lines& lines, std::size_t first, std::size_t columns,
                             std::size_t words_before) {
  const std::string_view line = lines.peek();
  const Words words = split(line);
  Coordinates found{};
  const auto field = [&](std::size_t axis) { return line.substr(first + axis * columns, columns); };
  if (words.count == words_before + found.size()) {
    bool in_columns = true;
    for (std::size_t axis = 0; axis < found.size(); ++axis) {
      found[axis] = words.words[words_before + axis];
      const auto begin = static_cast<std::size_t>(found[axis].data() - line.data());
      const std::size_t end = first + (axis + 1) * columns;
      in_columns = in_columns && begin + found[axis].size() == end && begin + columns >= end;
    }
    if (in_columns) {
      for (std::size_t axis = 0; axis < found.size(); ++axis) found[axis] = field(axis);
    }
    return found;
  }
  // Numbers that fill their columns have no blanks between them.
  const std::size_t end = first + found.size() * columns;
  const bool longer = line.size() > end && !trimmed(line.substr(end)).empty();
  if (longer || line.size() < first + 2 * columns + 1) {
    lines.scanner().refuse("three coordinates", line);
  }
  for (std::size_t axis = 0; axis < found.size(); ++axis) {
    found[axis] = field(axis);
    if (trimmed(found[axis]).empty()) lines.scanner().refuse("three coordinates", line);
    // Else a longer one in its place would move the next.
    if (axis < 2 && found[axis].ends_with(' ')) {
      lines.scanner().refuse("a number at the end of its columns", found[axis]);
    }
    while (found[axis].ends_with(' ')) found[axis].remove_suffix(1);
  }
  return found;
}

/// The rows of the transformation: the axes, then the origin.
bool is_global(const std::array<double, 12>& matrix) {
  for (std::size_t entry = 0; entry < matrix.size(); ++entry) {
    const double expected = entry < 9 && entry % 4 == 0 ? 1 : 0;
    if (matrix[entry] != expected) return false;
  }
  return true;
}

}  // namespace

void Nodes::read_single(Lines& lines) {
  constexpr std::size_t kFirst = 40;
  constexpr std::size_t kColumns = 13;
  while (lines.more()) {
    const Words words = split(lines.peek());
    const auto coordinates = find_coordinates(lines, kFirst, kColumns, 4);
    // Where words are not seven, the line is long enough for its columns.
    const bool in_words = words.count == 7;
    const auto integer = [&](std::size_t field) {
      return lines.scanner().parse<std::int64_t>(
          in_words ? words.words[field] : trimmed(lines.peek().substr(field * 10, 10)));
    };
    const std::int64_t node = integer(0);
    const std::int64_t system = integer(1);
    for (const std::size_t field : {2U, 3U}) {  // anything else there shifts the columns
      const bool blank = !in_words && trimmed(lines.peek().substr(field * 10, 10)).empty();
      if (!blank) (void)integer(field);
    }
    fields_.add(node, coordinates, lines.scanner());
    note_system(node, system);
    lines.take();
  }
}

void Nodes::read_double(Lines& lines) {
  constexpr std::size_t kColumns = 25;
  while (lines.more()) {
    const Integers head = lines.integers();
    lines.take();
    lines.require_more("the coordinates of node " + std::to_string(head[0]));
    fields_.add(head[0], find_coordinates(lines, 0, kColumns, 0), lines.scanner());
    if (head.count > 1) note_system(head[0], head[1]);
    lines.take();
  }
}

void Nodes::read_systems(Lines& lines) {
  if (!lines.more()) return;
  lines.take();  // the part's number
  if (!lines.more()) return;
  lines.take();  // its name
  while (lines.more()) {
    const Integers head = lines.integers();
    lines.take();
    lines.take();  // the system's name, which may be blank
    std::array<double, 12> matrix{};
    for (std::size_t row = 0; row < 4; ++row) {
      lines.require_more("the matrix of coordinate system " + std::to_string(head[0]));
      const Words words = split(lines.peek());
      for (std::size_t column = 0; column < std::min<std::size_t>(words.count, 3); ++column) {
        std::string word(words.words[column]);
        std::ranges::replace(word, 'D', 'E');
        matrix[row * 3 + column] = lines.scanner().parse<double>(word);
      }
      lines.take();
    }
    systems_[head[0]] = {head.count < 2 || head[1] == 0, is_global(matrix)};
  }
}

void Nodes::check_systems() const {
  for (const auto& [label, node] : first_node_) {
    const auto known = systems_.find(label);
    if (known == systems_.end()) continue;
    if (known->second.cartesian && (known->second.global || first_node_.size() == 1)) continue;
    fail("FORMAT_ERROR", file_,
         "node " + std::to_string(node) + " is given in coordinate system " +
             std::to_string(label) +
             (known->second.cartesian ? ", other nodes in others" : ", which is not Cartesian") +
             " (data set 2420); write all nodes in global coordinates");
  }
}

}  // namespace meshsmooth::formats::unv

#include "unv/lines.hpp"

#include <algorithm>
#include <charconv>

namespace meshsmooth::formats::unv {
namespace {

constexpr std::string_view kMark = "-1";
constexpr std::size_t kIntegerColumns = 10;

bool parse(std::string_view word, std::int64_t& value) {
  word = trimmed(word);
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// False: something in the line is not an integer, or there are too many.
bool parse(std::string_view line, Integers& found) {
  const Words words = split(line);
  found.count = std::min(words.count, found.values.size());
  bool all = words.count <= found.values.size();
  for (std::size_t field = 0; all && field < words.count; ++field) {
    all = words.words[field].size() <= kIntegerColumns &&
          parse(words.words[field], found.values[field]);
  }
  if (all) return true;
  // Numbers that fill their columns have no blanks between them.
  if (line.size() > found.values.size() * kIntegerColumns) return false;
  found.count = 0;
  for (std::size_t first = 0; first < line.size(); first += kIntegerColumns) {
    if (!parse(line.substr(first, kIntegerColumns), found.values[found.count++])) return false;
  }
  return true;
}

}  // namespace

Words split(std::string_view line) {
  Words found;
  std::size_t begin = line.find_first_not_of(" \t");
  while (begin != std::string_view::npos && found.count <= Words::kMost) {
    const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    if (found.count < Words::kMost) found.words[found.count] = line.substr(begin, end - begin);
    ++found.count;
    begin = line.find_first_not_of(" \t", end);
  }
  return found;
}

void Lines::skip_blank_lines() {
  while (!at_end() && trimmed(peek()).empty()) take();
}

bool Lines::next_data_set() {
  skip_blank_lines();
  if (at_end()) return false;
  if (trimmed(peek()) != kMark) {
    scanner_.refuse("-1, which opens a data set", trimmed(peek()));
  }
  take();
  skip_blank_lines();
  return !at_end();
}

bool Lines::more() {
  skip_blank_lines();
  if (at_end()) {
    unfinished_ = true;
    return false;
  }
  if (trimmed(peek()) != kMark) return true;
  take();
  return false;
}

void Lines::require_more(const std::string& what) {
  skip_blank_lines();
  if (at_end()) scanner_.truncated();
  if (trimmed(peek()) == kMark) scanner_.refuse(what, kMark);
}

Integers Lines::integers() const {
  Integers found;
  if (!parse(peek(), found) || found.count == 0) scanner_.refuse("integers", trimmed(peek()));
  return found;
}

Integers Lines::integers_of_next_line() const {
  Scanner ahead = scanner_;
  ahead.line();
  Integers found;
  if (!parse(ahead.peek_line(), found)) found.count = 0;
  return found;
}

}  // namespace meshsmooth::formats::unv

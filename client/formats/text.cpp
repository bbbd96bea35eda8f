#include "text.hpp"

#include <algorithm>

#include "file_bytes.hpp"

namespace meshsmooth::formats {

void fail(const std::string& reason, const std::filesystem::path& path, const std::string& what) {
  const std::string name = path == kStandardStream ? "standard input" : path.string();
  throw Error(reason, name + ": " + what, {{"path", path.string()}});
}

void fail_unknown_name(const std::string& what_is_called, const std::string& name,
                       const std::vector<std::string>& there_are) {
  std::string list;
  for (const std::string& other : there_are) list += (list.empty() ? "" : ", ") + other;
  throw InvalidOption(
      "NAME_UNKNOWN",
      what_is_called + " \"" + name + "\"; there " + (list.empty() ? "is none" : "are: " + list),
      {{"name", name}});
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return text.substr(0, 0);
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

void Scanner::skip_space(bool over_lines) {
  while (position_ < text_.size()) {
    const char next = text_[position_];
    if (comment_ != 0 && next == comment_) {
      position_ = std::min(text_.find('\n', position_), text_.size());
    } else if (next == ' ' || next == '\t' || next == '\r' || (over_lines && next == '\n')) {
      ++position_;
    } else {
      return;
    }
  }
}

Scanner::Scanner(std::filesystem::path path, std::string_view text, char comment)
    : path_(std::move(path)), text_(text), comment_(comment) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8, by editors
  if (text.starts_with(kByteOrderMark)) position_ = kByteOrderMark.size();
}

bool Scanner::at_end() {
  skip_space(true);
  return position_ == text_.size();
}

std::string_view Scanner::token() {
  if (at_end()) truncated();
  return token_on_line();
}

std::string_view Scanner::token_on_line() {
  skip_space(false);
  const std::size_t begin = position_;
  while (position_ < text_.size() &&
         std::string_view(" \t\r\n").find(text_[position_]) == std::string_view::npos &&
         (comment_ == 0 || text_[position_] != comment_)) {
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

std::string_view Scanner::peek_line() const {
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view found = text_.substr(position_, end - position_);
  if (found.ends_with('\r')) found.remove_suffix(1);
  return found;
}

std::string_view Scanner::line() {
  const std::string_view found = peek_line();
  position_ = std::min(std::min(text_.find('\n', position_), text_.size()) + 1, text_.size());
  return found;
}

std::string_view Scanner::bytes(std::size_t count) {
  if (count > text_.size() - position_) truncated();
  position_ += count;
  return text_.substr(position_ - count, count);
}

std::size_t Scanner::count() {
  const std::string_view word = token();
  const auto value = parse<std::size_t>(word);
  if (value > text_.size()) {
    fail("FILE_TRUNCATED", path_,
         where() + ": the file is too short for the " + std::string(word) + " things it announces");
  }
  return value;
}

std::string Scanner::where() const {
  const auto lines =
      std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(position_), '\n');
  return "line " + std::to_string(lines + 1);
}

void Scanner::refuse(std::string_view expected, std::string_view found) const {
  std::string shown(found.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  fail("FORMAT_ERROR", path_,
       where() + ": expected " + std::string(expected) + ", found \"" + shown + "\"");
}

void Scanner::truncated() const {
  fail("FILE_TRUNCATED", path_, where() + ": the file ends too early");
}

}  // namespace meshsmooth::formats

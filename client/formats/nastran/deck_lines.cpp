#include "nastran/deck_lines.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <unordered_map>

#include "self_contained.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr std::size_t kMostNested = 32;
constexpr std::size_t kMostIncluded = 10'000;

/// Without blanks, tabs and a carriage return behind.
std::string_view without_blanks_behind(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) {
    text.remove_suffix(1);
  }
  return text;
}

std::string shown(std::string_view text) {
  std::string result(text.substr(0, 60));
  std::ranges::replace_if(
      result, [](char c) { return c < ' ' || c > '~'; }, '?');
  return result;
}

}  // namespace

NastranLines::NastranLines(const path& path) { open(path); }

void NastranLines::open(const path& path) {
  std::error_code error;
  texts_.push_back(read_bytes(path));
  if (texts_.back().find('\0') != std::string::npos) {
    fail("FORMAT_ERROR", path, "not a text file: it contains NUL bytes");
  }
  const auto known = std::ranges::find_if(
      files_, [&](const auto& file) { return std::filesystem::equivalent(file, path, error); });
  const auto file = static_cast<std::uint32_t>(known - files_.begin());
  if (known == files_.end()) {
    files_.push_back(path);
    node_readings_.push_back(0);
  }
  readings_.push_back({file, texts_.back()});
  if (texts_.back().starts_with("\xEF\xBB\xBF")) readings_.back().position = 3;  // a mark of UTF-8
  open_.push_back(0);
  segments_.push_back({texts_.back(), texts_.size(), {file, false, {}, {}, {}}});
  open_.back() = segments_.size() - 1;
}

/// The segment before it has just ended.
void NastranLines::begin_segment(bool directive) {
  const Segment& before = segments_[open_.back()];
  const Reading& reading = readings_.back();
  const auto begin =
      static_cast<std::size_t>(before.text.data() - reading.text.data()) + before.text.size();
  segments_.push_back(
      {reading.text.substr(begin), before.index, {reading.file, directive, {}, {}, {}}});
  open_.back() = segments_.size() - 1;
}

void NastranLines::end_segment(std::size_t end) {
  Segment& segment = segments_[open_.back()];
  const auto begin = static_cast<std::size_t>(segment.text.data() - readings_.back().text.data());
  segment.text = segment.text.substr(0, end - begin);
}

std::string_view NastranLines::take_line() {
  Reading& reading = readings_.back();
  const std::string_view left = reading.text.substr(reading.position);
  const void* const found = std::memchr(left.data(), '\n', left.size());
  const std::size_t end =
      found == nullptr ? left.size()
                       : static_cast<std::size_t>(static_cast<const char*>(found) - left.data());
  reading.position = std::min(reading.position + end + 1, reading.text.size());
  ++reading.line;
  return left.substr(0, end);
}

bool NastranLines::next() {
  while (!readings_.empty()) {
    Reading& reading = readings_.back();
    if (reading.position == reading.text.size()) {
      end_segment(reading.text.size());
      readings_.pop_back();
      open_.pop_back();
      if (!readings_.empty()) begin_segment(false);
      continue;
    }
    const std::size_t begin = reading.position;
    const std::string_view bytes = take_line();
    const std::size_t comment = std::min(bytes.find('$'), bytes.size());
    if (comment < bytes.size()) {
      comments_.push_back(without_blanks_behind(bytes.substr(comment + 1)));
    }
    const std::string_view text = without_blanks_behind(bytes.substr(0, comment));
    if (text.empty()) continue;
    std::string_view rest;
    if (is_include(bytes, rest)) {
      include(begin, rest);
      continue;
    }
    const std::size_t end = std::min(bytes.find_first_not_of(' ', text.size()), bytes.size());
    const std::size_t blanks = comment == bytes.size() ? end - text.size() : 0;
    line_ = {text, reading.file, reading.line, open_.back(), blanks};
    return true;
  }
  return false;
}

void NastranLines::stop() {
  while (!readings_.empty()) {
    end_segment(readings_.back().text.size());
    readings_.pop_back();
    open_.pop_back();
    if (!readings_.empty()) begin_segment(false);
  }
}

bool NastranLines::is_continued_elsewhere() const {
  for (std::size_t index = 0; index + 1 < readings_.size(); ++index) {
    std::string_view left = readings_[index].text.substr(readings_[index].position);
    while (!left.empty()) {
      const std::size_t end = std::min(left.find('\n'), left.size());
      const std::string_view text = trimmed(left.substr(0, std::min(left.find('$'), end)));
      left.remove_prefix(std::min(end + 1, left.size()));
      std::string name(text.substr(0, 7));
      std::ranges::transform(name, name.begin(), [](unsigned char letter) {
        return static_cast<char>(std::toupper(letter));
      });
      if (!text.empty() && name != "ENDDATA") return true;
    }
  }
  return false;
}

// --- included files -----------------------------------------------------------------

/// "INCLUDE 'name'", also with the name in the next line. `rest`: what follows the word.
bool NastranLines::is_include(std::string_view line, std::string_view& rest) const {
  constexpr std::string_view kWord = "INCLUDE";
  line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  if (line.size() < kWord.size()) return false;
  for (std::size_t at = 0; at < kWord.size(); ++at) {
    if (std::toupper(static_cast<unsigned char>(line[at])) != kWord[at]) return false;
  }
  rest = trimmed(line.substr(kWord.size()));
  return line.size() == kWord.size() ||
         std::string_view(" \t\r'\"=").find(line[kWord.size()]) != std::string_view::npos;
}

/// The name may go on over several lines.
std::string NastranLines::included_name(std::string_view rest, std::uint32_t first_line) {
  const auto more = [&] {
    if (readings_.back().position < readings_.back().text.size()) return true;
    fail_at(readings_.back().file, first_line, "the file ends inside of INCLUDE", "FILE_TRUNCATED");
  };
  if (rest.starts_with('=')) rest = trimmed(rest.substr(1));
  while (rest.empty() && more()) rest = trimmed(take_line());
  const char quote = rest.front();
  if (quote != '\'' && quote != '"') {
    std::string name(rest.substr(0, rest.find_first_of(" \t$")));
    while (name.ends_with('/') && more()) name += trimmed(take_line());
    return name;
  }
  std::string name(rest.substr(1));
  while (name.find(quote) == std::string::npos && more()) name += trimmed(take_line());
  name.erase(name.find(quote));
  return std::string(trimmed(name));
}

void NastranLines::include(std::size_t begin, std::string_view rest) {
  const std::uint32_t line = readings_.back().line;
  const path file = find_included(included_name(rest, line), line);
  end_segment(begin);
  begin_segment(true);
  end_segment(readings_.back().position);
  open(file);
}

path NastranLines::find_included(const std::string& name, std::uint32_t line) {
  check_reference(files_.front(), name);
  const std::uint32_t own = readings_.back().file;
  std::string slashes = name;
  std::ranges::replace(slashes, '\\', '/');
  std::error_code error;
  const path beside = files_[own].parent_path();
  const path main = files_.front().parent_path();
  for (const path& candidate : {beside / name, main / name, beside / slashes, main / slashes}) {
    if (name.empty() || !std::filesystem::is_regular_file(candidate, error)) continue;
    const auto is_open = [&](const Reading& reading) {
      return std::filesystem::equivalent(files_[reading.file], candidate, error);
    };
    if (std::ranges::any_of(readings_, is_open)) {
      fail_at(own, line, "\"" + shown(name) + "\" includes itself; take this INCLUDE out");
    }
    if (readings_.size() == kMostNested || texts_.size() > kMostIncluded) {
      fail_at(own, line, "expected fewer included files");
    }
    return candidate;
  }
  fail_at(own, line,
          "there is no file \"" + shown(name) + "\" to include; its name is relative to this file",
          "FILE_NOT_FOUND");
}

// --- what the readers find ----------------------------------------------------------

std::size_t NastranLines::offset_of(const NastranLine& line, const char* at) const {
  return static_cast<std::size_t>(at - segments_[line.segment].text.data());
}

void NastranLines::add_fields(const NastranLine& line, std::int64_t id,
                              const std::array<CoordinateFields::Field, 3>& fields,
                              const Vec3d& read, NodeId node) {
  Segment& segment = segments_[line.segment];
  std::size_t& reading = node_readings_[line.file];
  if (reading == 0) reading = segment.index;
  if (reading != segment.index) {
    fail_at(line.file, line.number,
            "there are nodes in a file that is included twice; their coordinates stand in it once");
  }
  CoordinateFields& found = segment.stored.fields;
  found.node_ids.push_back(id);
  found.fields.push_back(fields);
  found.positions.push_back(read);
  segment.stored.nodes.push_back(node);
}

void NastranLines::fail_at(std::uint32_t file, std::uint32_t line, const std::string& what,
                           const std::string& reason) const {
  fail(reason, files_[file], "line " + std::to_string(line) + ": " + what);
}

void NastranLines::refuse(const NastranLine& line, const std::string& expected,
                          std::string_view found) const {
  fail_at(line.file, line.number, "expected " + expected + ", found \"" + shown(found) + "\"");
}

/// The cards of a node that is there more than once take numbers of as many columns as the
/// narrowest of them has, so that they say the same again. A number between commas may take eight
/// in every line.
void NastranLines::share_digits(std::vector<TextSegment>& segments) {
  struct Cards {
    int count = 0;
    std::uint8_t digits = CoordinateFields::Field{}.digits;
  };
  std::unordered_map<NodeId, Cards> nodes;
  constexpr std::uint8_t kBetweenCommas = 8;
  for (const TextSegment& segment : segments) {
    for (std::size_t place = 0; place < segment.nodes.size(); ++place) {
      Cards& cards = nodes[segment.nodes[place]];
      ++cards.count;
      for (const CoordinateFields::Field& field : segment.fields.fields[place]) {
        cards.digits = std::min(cards.digits, field.columns > 0 ? field.columns : kBetweenCommas);
      }
    }
  }
  for (TextSegment& segment : segments) {
    for (std::size_t place = 0; place < segment.nodes.size(); ++place) {
      const Cards& cards = nodes[segment.nodes[place]];
      if (cards.count == 1) continue;
      for (auto& field : segment.fields.fields[place]) field.digits = cards.digits;
    }
  }
}

void NastranLines::store(FileContent& content, const std::vector<NodeId>& numbers) {
  stop();
  for (Segment& segment : segments_) {
    if (segment.text.empty()) continue;
    segment.stored.text = segment.text;
    for (NodeId& node : segment.stored.nodes) {
      if (!numbers.empty()) node = numbers[static_cast<std::size_t>(node)];
    }
    content.segments.push_back(std::move(segment.stored));
  }
  if (!numbers.empty()) share_digits(content.segments);
  content.files = std::move(files_);
}

}  // namespace meshsmooth::formats

#include "deck_reader.hpp"

#include <algorithm>
#include <cctype>

#include "self_contained.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr std::string_view kBlanks = " \t\r";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kMostNested = 32;
constexpr std::size_t kMostIncluded = 10'000;

std::string without_blanks(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (kBlanks.find(c) == std::string_view::npos) result += c;
  }
  return result;
}

/// The next comma that is not in quotes, or the end of the line.
std::size_t end_of_part(std::string_view line, std::size_t begin) {
  const std::size_t comma = std::min(line.find(',', begin), line.size());
  const std::size_t quote = line.substr(0, comma).find('"', begin);
  const std::size_t closing = quote == line.npos ? quote : line.find('"', quote + 1);
  return closing == line.npos ? comma : std::min(line.find(',', closing), line.size());
}

bool is_comment(std::string_view line) {
  const std::string_view text = trimmed(line);
  return text.empty() || text.starts_with("**");
}

/// A line after one that ends with a comma: parameters have names, so that numbers are data.
bool continues_keyword(std::string_view line) {
  const std::string_view text = trimmed(line);
  return std::string_view("*0123456789+-.,").find(text.front()) == std::string_view::npos;
}

}  // namespace

std::string in_capitals(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char letter) {
    return static_cast<char>(std::toupper(letter));
  });
  return result;
}

void split_data(std::string_view line, std::vector<std::string_view>& parts) {
  parts.clear();
  std::size_t begin = 0;
  while (begin <= line.size()) {
    const std::size_t comma = end_of_part(line, begin);
    const std::string_view part = line.substr(begin, comma - begin);
    parts.push_back(part.substr(0, part.find_last_not_of(kBlanks) + 1));
    begin = comma + 1;
  }
  if (parts.back().empty()) parts.pop_back();  // after a comma at the end
}

const DeckKeyword::Parameter* DeckKeyword::find(std::string_view wanted) const {
  const auto found = std::ranges::find(parameters, wanted, &Parameter::name);
  return found == parameters.end() ? nullptr : &*found;
}

std::string DeckKeyword::value(std::string_view wanted) const {
  const Parameter* found = find(wanted);
  return found == nullptr ? std::string() : found->value;
}

DeckReader::DeckReader(const path& path) { open(path); }

void DeckReader::open(const path& path) {
  std::error_code error;
  texts_.push_back(read_bytes(path));
  if (texts_.back().find('\0') != std::string::npos) {
    const bool wide =
        texts_.back().starts_with("\xFF\xFE") || texts_.back().starts_with("\xFE\xFF");
    fail("FORMAT_ERROR", path,
         wide ? "this is UTF-16; save it as UTF-8" : "not a text file: it contains NUL bytes");
  }
  const auto known = std::ranges::find_if(
      files_, [&](const auto& file) { return std::filesystem::equivalent(file, path, error); });
  const auto file = static_cast<std::size_t>(known - files_.begin());
  if (known == files_.end()) {
    files_.push_back(path);
    node_readings_.push_back(0);
  }
  sources_.push_back({file, texts_.size(), Scanner(path, texts_.back()), texts_.back()});
  Source& source = sources_.back();
  source.fields.style = NumberStyle::deck;
  if (!source.text.starts_with(kByteOrderMark)) return;
  if (sources_.size() > 1) close_segment(source, kByteOrderMark.size(), true);  // not in a line
}

void DeckReader::close_segment(Source& source, std::size_t end, bool directive) {
  CoordinateFields fields = std::exchange(source.fields, {});
  source.fields.style = NumberStyle::deck;
  for (auto& node : fields.fields) {
    for (CoordinateFields::Field& field : node) field.begin -= source.segment_begin;
  }
  const std::string_view text =
      source.text.substr(source.segment_begin, end - source.segment_begin);
  segments_.push_back({source.file, directive, std::string(text), std::move(fields),
                       std::exchange(source.nodes, {})});
  source.segment_begin = end;
}

void DeckReader::consume(Source& source) {
  source.scanner.line();
  ++source.line;
  source.started = false;
}

bool DeckReader::next() {
  if (pending_) {
    const DeckKeyword::Parameter input = *std::exchange(pending_, std::nullopt);
    const path file = find_included(input.value);
    Source& source = sources_.back();
    consume(source);
    close_segment(source, input.begin, false);
    close_segment(source, input.end, true);
    close_segment(source, source.scanner.position(), false);
    open(file);
  }
  while (!sources_.empty()) {
    Source& source = sources_.back();
    if (source.started) consume(source);
    if (source.scanner.position() == source.text.size()) {
      close_segment(source, source.text.size(), false);
      sources_.pop_back();
      continue;
    }
    line_ = source.scanner.peek_line();
    source.started = true;
    if (is_comment(line_)) continue;
    if (!at_keyword() || !in_capitals(without_blanks(line_)).starts_with("*INCLUDE")) return true;
    const std::size_t begin = source.scanner.position();
    const DeckKeyword found = keyword();
    if (found.name != "INCLUDE") refuse("*INCLUDE", line_);
    const path file = find_included(found.value("INPUT"));
    consume(source);
    close_segment(source, begin, false);
    close_segment(source, source.scanner.position(), true);
    open(file);
  }
  return false;
}

path DeckReader::find_included(const std::string& name) const {
  if (name.empty()) refuse("INPUT=, the name of a file", line_);
  check_reference(files_.front(), name);
  std::error_code error;
  std::string slashes = name;  // of a deck that was written on Windows
  std::ranges::replace(slashes, '\\', '/');
  const path folder = files_[sources_.back().file].parent_path();
  const path main = files_.front().parent_path();
  const path beside = folder / name;
  for (const path& candidate : {beside, main / name, folder / slashes, main / slashes}) {
    if (!std::filesystem::is_regular_file(candidate, error)) continue;
    const auto is_open = [&](const Source& source) {
      return std::filesystem::equivalent(files_[source.file], candidate, error);
    };
    if (std::ranges::any_of(sources_, is_open)) refuse("a file that does not include itself", "");
    if (sources_.size() == kMostNested || segments_.size() > kMostIncluded) {
      refuse("fewer included files", "");
    }
    return candidate;
  }
  fail_at(place(), "there is no file \"" + beside.string() + "\" to include", "FILE_NOT_FOUND");
}

DeckKeyword DeckReader::keyword() {
  DeckKeyword keyword;
  keyword.place = place();
  Source& source = sources_.back();
  bool continued = true;
  for (bool first = true; continued; first = false) {
    if (!first) {
      const Scanner scanner = source.scanner;
      const std::size_t line_number = source.line;
      do {
        consume(source);
        if (source.scanner.position() == source.text.size()) {
          fail_at(keyword.place, "the file ends inside of this keyword", "FILE_TRUNCATED");
        }
        line_ = source.scanner.peek_line();
      } while (is_comment(line_));
      source.started = true;
      if (!continues_keyword(line_)) {  // back to the keyword's last line
        source.scanner = scanner;
        source.line = line_number;
        break;
      }
    }
    std::vector<std::string_view> parts;
    split_data(line_, parts);
    continued = trimmed(line_).ends_with(',');
    for (const std::string_view part : parts) {
      if (first && part.data() == line_.data()) {
        keyword.name = in_capitals(without_blanks(part)).substr(1);  // without the star
        continue;
      }
      const std::size_t equals = std::min(part.find('='), part.size());
      std::string_view value = trimmed(part.substr(std::min(equals + 1, part.size())));
      if (value.size() > 1 && value.front() == '"' && value.back() == '"') {
        value = value.substr(1, value.size() - 2);
      }
      const std::size_t begin = source.scanner.offset_of(part);
      keyword.parameters.push_back({in_capitals(without_blanks(part.substr(0, equals))),
                                    std::string(value), begin - (part.data() > line_.data()),
                                    begin + part.size()});
    }
  }
  return keyword;
}

void DeckReader::read_input_of(const DeckKeyword& keyword) {
  const auto* input = keyword.find("INPUT");
  if (input == nullptr) return;
  if (sources_.back().text[input->begin] != ',') {
    fail_at(keyword.place, "expected INPUT in the first line of the keyword");
  }
  if (std::ranges::count(keyword.parameters, "INPUT", &DeckKeyword::Parameter::name) > 1) {
    fail_at(keyword.place, "INPUT is given twice");
  }
  pending_ = *input;
}

void DeckReader::add_node(NodeId node, std::int64_t label, std::array<std::string_view, 3> words) {
  Source& source = sources_.back();
  std::size_t& reading = node_readings_[source.file];
  if (reading == 0) reading = source.reading;
  if (reading != source.reading) {
    refuse("no nodes in a file that is included twice: their coordinates stand in it once", "");
  }
  std::array<bool, 3> missing{};
  bool comma_at_end = trimmed(line_).ends_with(',');
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (words[axis].data() != nullptr) continue;
    missing[axis] = !std::exchange(comma_at_end, false);
    words[axis] = line_.substr(line_.find_last_not_of(kBlanks) + 1, 0);
  }
  source.fields.add(label, words, source.scanner);
  source.nodes.push_back(node);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    source.fields.fields.back()[axis].missing = missing[axis];
  }
}

DeckPlace DeckReader::place() const {
  if (sources_.empty()) return {0, 0};
  return {sources_.back().file, sources_.back().line};
}

std::string DeckReader::describe(const DeckPlace& place) const {
  const std::string line = "line " + std::to_string(place.line);
  return place.file == 0 ? line : files_[place.file].string() + ": " + line;
}

void DeckReader::fail_at(const DeckPlace& place, const std::string& what,
                         const std::string& reason) const {
  fail(reason, files_[place.file],
       (place.line == 0 ? "" : "line " + std::to_string(place.line) + ": ") + what);
}

void DeckReader::refuse(std::string_view expected, std::string_view found) const {
  std::string shown(found.substr(0, 40));
  std::ranges::replace_if(
      shown, [](char c) { return c < ' ' || c > '~'; }, '?');
  fail_at(place(),
          "expected " + std::string(expected) + (shown.empty() ? "" : ", found \"" + shown + "\""));
}

void DeckReader::truncated(const std::string& what) const {
  fail("FILE_TRUNCATED", files_.front(), "the deck ends " + what);
}

std::int64_t DeckReader::label(std::string_view word) const {
  const std::string_view digits = trimmed(word);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || value < 1) {
    refuse("a number above 0", word);
  }
  return value;
}

void DeckReader::store(FileContent& content) {
  content.files = std::move(files_);
  content.segments = std::move(segments_);
}

}  // namespace meshsmooth::formats

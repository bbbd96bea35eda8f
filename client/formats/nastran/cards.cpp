#include "nastran/cards.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "nastran/numbers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::size_t kEnd = 72;  // of the columns of data
constexpr std::size_t kTab = 8;

/// Columns that a character takes.
std::size_t width_of(std::string_view text, std::size_t at, std::size_t column, bool separates) {
  if (text[at] != '\t') return 1;
  const bool behind_full = at > 0 && column % kTab == 0 && text[at - 1] != '\t';
  return separates && behind_full ? 0 : kTab - column % kTab;
}

std::string with_blanks(std::string_view text, bool separates) {
  std::string result;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '\t') {
      result.append(width_of(text, at, result.size(), separates), ' ');
    } else {
      result += text[at];
    }
  }
  return result;
}

/// The part between commas; null data: the line ends before it.
std::string_view between_commas(std::string_view text, std::size_t number) {
  while (number > 0) {
    const std::size_t comma = text.find(',');
    if (comma == std::string_view::npos) return {};
    text.remove_prefix(comma + 1);
    --number;
  }
  return text.substr(0, text.find(','));
}

NastranCardLine make_card_line(const NastranLine& line) {
  NastranCardLine result;
  result.line = line;
  std::string_view text = line.text;
  if (text.find('\t') != std::string_view::npos) {
    result.expanded = with_blanks(text, false);
    result.has_full_fields = with_blanks(text, true) != result.expanded;
    text = result.expanded;
  }
  if (text.substr(0, kEnd).find(',') != std::string_view::npos) {
    result.form = NastranCardLine::Form::free;
    result.has_full_fields = false;
    result.expanded.clear();
  }
  const std::string_view first = result.field(-1);
  result.wide = first.starts_with('*') || first.ends_with('*');
  if (result.wide && result.form == NastranCardLine::Form::small) {
    result.form = NastranCardLine::Form::large;
  }
  return result;
}

bool is_continuation(const NastranCardLine& line) {
  const std::string_view first = line.field(-1);
  return first.empty() || first.front() == '+' || first.front() == '*';
}

/// "GRID" of "grid   *".
std::string name_of(const NastranCardLine& line) {
  std::string_view first = line.field(-1);
  if (first.ends_with('*')) first = trimmed(first.substr(0, first.size() - 1));
  return nastran_capitals(first);
}

bool starts_with_word(const std::string& text, std::string_view word) {
  return text.starts_with(word) &&
         (text.size() == word.size() ||
          std::isalnum(static_cast<unsigned char>(text[word.size()])) == 0);
}

/// Whether a line is the one before bulk data, or a card that only bulk data has; or neither.
enum class LineKind { begin, card, other };
LineKind kind_of(std::string_view line) {
  const std::string word = nastran_capitals(trimmed(line.substr(0, kEnd)).substr(0, 6));
  if (starts_with_word(word, "BEGIN")) return LineKind::begin;
  return starts_with_word(word, "GRID") ? LineKind::card : LineKind::other;
}

/// Whether BEGIN comes before the first node, through all included files: the deck may be written
/// as one file.
bool has_begin_through_files(const std::filesystem::path& file) {
  NastranLines lines(file);
  while (lines.next()) {
    const LineKind kind = kind_of(lines.line().text);
    if (kind != LineKind::other) return kind == LineKind::begin;
  }
  return false;
}

/// The same, which looks at the included files only where it must.
bool has_begin(const NastranLines& lines) {
  std::string_view text = lines.main_text();
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    const LineKind kind = kind_of(line);
    if (kind != LineKind::other) return kind == LineKind::begin;
    if (nastran_capitals(trimmed(line).substr(0, 7)) == "INCLUDE") {
      return has_begin_through_files(lines.main_file());
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return false;
}

}  // namespace

std::string nastran_capitals(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char letter) {
    return static_cast<char>(std::toupper(letter));
  });
  return result;
}

void NastranCardLine::separate_by_tabs() {
  if (!has_full_fields) return;
  tabs_separate = true;
  expanded = with_blanks(line.text, true);
}

bool NastranCard::has_full_fields_before_tabs() const {
  return std::ranges::any_of(lines, &NastranCardLine::has_full_fields);
}

void NastranCard::separate_by_tabs() {
  for (NastranCardLine& line : lines) line.separate_by_tabs();
}

std::string_view NastranCardLine::field(std::ptrdiff_t number) const {
  const auto place = static_cast<std::size_t>(number + 1);
  if (form == Form::free) return trimmed(between_commas(line.text, place));
  const std::string_view text = columns();
  if (number < 0) return trimmed(text.substr(0, kTab));
  const std::size_t begin = column_of(place - 1);
  if (begin >= text.size()) return {};
  return trimmed(text.substr(begin, column_count()));
}

CoordinateFields::Field NastranCardLine::locate(std::size_t number,
                                                const NastranLines& lines) const {
  if (form != Form::free) return locate_columns(number, lines);
  CoordinateFields::Field found{};
  const std::string_view part = between_commas(line.text, number + 1);
  const std::string_view word = trimmed(part);
  const auto commas = static_cast<std::size_t>(std::ranges::count(line.text, ','));
  found.missing = part.data() == nullptr;
  found.lead = static_cast<std::uint8_t>(found.missing ? number + 1 - commas : 0);
  const char* const end = line.text.data() + line.text.size();
  found.begin = lines.offset_of(line, found.missing ? end : word.data());
  found.length = word.size();
  return found;
}

CoordinateFields::Field NastranCardLine::locate_columns(std::size_t number,
                                                        const NastranLines& lines) const {
  CoordinateFields::Field found{};
  // Blanks behind the text are columns, too.
  const std::string_view bytes(line.text.data(), line.text.size() + line.blanks);
  // A tab reaches to the next multiple of eight columns, so never beyond the field.
  const std::size_t first = column_of(number);
  const std::size_t end = first + column_count();
  std::size_t column = 0;
  std::size_t at = 0;
  const auto step = [&] { return width_of(bytes, at, column, tabs_separate); };
  for (; at < bytes.size() && (column < first || step() == 0); ++at) column += step();
  found.begin = lines.offset_of(line, bytes.data() + at);
  found.columns = static_cast<std::uint8_t>(column_count());
  found.missing = at == bytes.size();
  found.lead = static_cast<std::uint8_t>(first - column);
  for (; at < bytes.size() && column < end; ++at, ++found.length) column += step();
  if (found.length > 0 && bytes[at - 1] == '\t') {  // stays, and needs a column
    --found.length;
    --found.columns;
  }
  return found;
}

const NastranCardLine* NastranCard::line_of(std::size_t& number) const {
  for (const NastranCardLine& line : lines) {
    if (number < line.field_count()) return &line;
    number -= line.field_count();
  }
  return nullptr;
}

std::string_view NastranCard::field(std::size_t number) const {
  const NastranCardLine* const found = line_of(number);
  return found == nullptr ? std::string_view() : found->field(static_cast<std::ptrdiff_t>(number));
}

std::size_t NastranCard::field_count() const {
  std::size_t count = 0;
  for (const NastranCardLine& line : lines) count += line.field_count();
  return count;
}

NastranCards::NastranCards(NastranLines& lines, NastranControl& control)
    : lines_(lines), control_(control) {
  in_bulk_ = !has_begin(lines);
}

/// ENDDATA. In an included file it ends the deck, too: what would be left out must not be missed.
bool NastranCards::ends_here() {
  const NastranLine& line = lines_.line();
  const std::string_view text = trimmed(line.text);
  if (text.size() < 7 || (text.front() != 'E' && text.front() != 'e')) return false;
  if (!starts_with_word(nastran_capitals(text.substr(0, 8)), "ENDDATA")) return false;
  if (lines_.is_continued_elsewhere()) {
    lines_.fail_at(line.file, line.number,
                   "ENDDATA ends the deck here, but a file that includes this one has more cards; "
                   "take it out");
  }
  lines_.stop();
  return true;
}

/// Whether the line is none of bulk data.
bool NastranCards::take_control_line() {
  const std::string_view text = trimmed(lines_.line().text);
  const char first = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (first == 'B') {
    const std::string line = nastran_capitals(text);
    if (starts_with_word(line, "BEGIN")) {
      in_bulk_ = true;
      section_ = trimmed(std::string_view(line).substr(5));
      return true;
    }
  }
  if (first == 'C' && starts_with_word(nastran_capitals(text.substr(0, 5)), "CEND")) {
    in_bulk_ = false;
    return true;
  }
  if (!in_bulk_ && starts_with_word(nastran_capitals(text.substr(0, 5)), "GRID")) {
    in_bulk_ = true;  // without BEGIN BULK, or before it: no node may get lost
  }
  if (!in_bulk_) control_.read_control_line(lines_.line());
  return !in_bulk_;
}

bool NastranCards::read_next() {
  while (lines_.next()) {
    if (ends_here()) return false;
    if (take_control_line()) continue;
    pending_ = make_card_line(lines_.line());
    const auto& comments = lines_.comments();
    comments_.insert(comments_.end(), comments.begin(), comments.end());
    lines_.forget_comments();
    return true;
  }
  return false;
}

bool NastranCards::next(NastranCard& card) {
  card.lines.clear();
  if (!pending_ && !read_next()) return false;
  const NastranLine start = pending_->line;
  if (is_continuation(*pending_)) {
    lines_.refuse(start, "a card before its continuation", start.text);
  }
  if (section_) control_.begin_section(*std::exchange(section_, std::nullopt));
  card.name = name_of(*pending_);
  card.comments = std::exchange(comments_, {});
  if (card.name.starts_with('=')) {
    lines_.refuse(start, "a card written out, not the replication of another one", start.text);
  }
  card.lines.push_back(*std::exchange(pending_, std::nullopt));
  while (read_next() && is_continuation(*pending_) && pending_->line.same_segment(start)) {
    card.lines.push_back(*std::exchange(pending_, std::nullopt));
  }
  return true;
}

}  // namespace meshsmooth::formats

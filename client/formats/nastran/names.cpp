#include "nastran/names.hpp"

#include <algorithm>
#include <span>

#include "nastran/numbers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

/// Words between blanks and commas; "1THRU5" is three.
std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  const auto is_separator = [](char c) {
    return c == ' ' || c == ',' || c == '\t' || c == '\r' || c == '=';
  };
  std::size_t at = 0;
  while (at < text.size()) {
    if (is_separator(text[at])) {
      ++at;
      continue;
    }
    std::size_t end = at;
    const bool digit = text[at] >= '0' && text[at] <= '9';
    while (end < text.size() && !is_separator(text[end]) &&
           !(digit && (text[end] == 'T' || text[end] == 't'))) {
      ++end;
    }
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// What stands between quotes.
std::string quoted(std::string_view text) {
  const std::size_t first = text.find('"');
  if (first == std::string_view::npos) return {};
  const std::size_t last = text.find('"', first + 1);
  if (last == std::string_view::npos) return {};
  return std::string(trimmed(text.substr(first + 1, last - first - 1)));
}

/// The rest behind `what`; null data: the text does not have it.
std::string_view behind(std::string_view text, std::string_view what) {
  const std::size_t at = text.find(what);
  return at == std::string_view::npos ? std::string_view() : text.substr(at + what.size());
}

std::optional<std::int64_t> leading_id(std::string_view text) {
  text = trimmed(text);
  return parse_nastran_integer(text.substr(0, text.find_first_not_of("0123456789")));
}

}  // namespace

// --- sets ---------------------------------------------------------------------------

void NastranNames::read_control_line(const NastranLine& line) {
  const std::string_view text = trimmed(line.text);
  const bool begins = control_set_.empty();
  if (begins && (nastran_capitals(text.substr(0, 3)) != "SET" || text.size() < 5 ||
                 text.find('=') == std::string_view::npos ||
                 std::string_view(" \t").find(text[3]) == std::string_view::npos)) {
    return;
  }
  control_set_.append(begins ? text.substr(3) : text).append(" ");
  if (!text.ends_with(',')) finish_control_set();
}

/// Sets of other things than ids (frequencies, "12/T3") are none of ours.
void NastranNames::finish_control_set() {
  const std::string text = std::exchange(control_set_, {});
  const std::vector<std::string_view> words = words_of(text);
  if (words.empty()) return;
  const auto id = parse_nastran_integer(words.front());
  IdList ids;
  if (id && ids.add_words(std::span(words).subspan(1))) {
    sets_.push_back({"SET", *id, false, std::move(ids)});
  }
}

bool NastranNames::read_set(const NastranCard& card) {
  const auto id = parse_nastran_integer(card.field(0));
  if (!id) return false;
  const bool described = card.name == "SET3";
  const std::string what = described ? nastran_capitals(card.field(1)) : "GRID";
  const bool of_elements = what == "ELEM" || what == "ELEMENT";
  if (!of_elements && what != "GRID" && what != "POINT") return true;
  std::vector<std::string_view> words;
  for (std::size_t field = described ? 2 : 1; field < card.field_count(); ++field) {
    const std::string_view word = card.field(field);
    if (nastran_capitals(word) != "SKIN") words.push_back(word);  // of aerodynamics
  }
  IdList ids;
  if (!ids.add_words(words)) return false;
  sets_.push_back({card.name, *id, of_elements, std::move(ids)});
  return true;
}

std::vector<NastranNames::Set> NastranNames::sets() const {
  std::vector<Set> all;
  for (const NumberedSet& set : sets_) {
    const auto named = set_names_.find(set.id);
    const bool has_name = set.card == "SET" && named != set_names_.end();
    all.push_back({has_name ? named->second.name : set.card + " " + std::to_string(set.id),
                   has_name ? named->second.of_elements : set.of_elements, set.ids});
  }
  for (const auto& [component, elements] : components_) {
    const auto named = component_names_.find(component);
    if (named != component_names_.end()) all.push_back({named->second, true, elements});
  }
  return all;
}

// --- names --------------------------------------------------------------------------

void NastranNames::read_comment(std::string_view comment) {
  if (comment.starts_with("HM") || moving_to_) {
    read_hypermesh(comment);
  } else if (comment.starts_with("ANSA_NAME")) {
    read_ansa(comment);
  } else if (comment.starts_with(" Femap")) {
    const std::string_view rest = behind(comment, " Property ");
    name_property(leading_id(rest), behind(rest, " : "));
  } else if (const auto set = behind(comment, " Pset: "); !set.empty()) {
    const std::string card = quoted(behind(set, " imported as: "));
    name_property(leading_id(behind(card, ".")), quoted(set));
  } else if (const auto region = behind(comment, " Properties for region : "); !region.empty()) {
    pending_ = trimmed(region);
  } else if (comment.starts_with('*')) {
    if (const auto name = behind(comment, " Property: "); !name.empty()) pending_ = trimmed(name);
  }
}

void NastranNames::name_property(std::optional<std::int64_t> id, std::string_view name) {
  if (id && !trimmed(name).empty()) property_names_[*id] = trimmed(name);
}

/// "HMNAME COMP    1"skin" …", "HMSET   1   1 "top"", "HMMOVE   2" and lines of elements.
void NastranNames::read_hypermesh(std::string_view comment) {
  if (moving_to_ && !comment.starts_with("HM")) {
    const std::vector<std::string_view> words = words_of(comment);
    IdList& elements = components_[*moving_to_];
    if (words.empty() || !elements.add_words(words)) moving_to_.reset();
    return;
  }
  moving_to_.reset();
  if (comment.starts_with("HMMOVE")) {
    moving_to_ = leading_id(comment.substr(6));
    return;
  }
  const std::string name = quoted(comment);
  if (name.empty()) return;
  const std::string_view before = comment.substr(0, comment.find('"'));
  const std::vector<std::string_view> words = words_of(before);
  if (words.front() == "HMSET" && words.size() >= 3) {
    if (const auto id = parse_nastran_integer(words[1])) {
      set_names_[*id] = {name, words[2] == "2"};
    }
  } else if (words.front() == "HMNAME" && words.size() >= 3) {
    const auto id = parse_nastran_integer(words[2]);
    if (!id) return;
    if (words[1] == "PROP") property_names_[*id] = name;
    if (words[1] == "COMP") component_names_[*id] = name;
  }
}

/// "ANSA_NAME_COMMENT;5;PSHELL;skin;…".
void NastranNames::read_ansa(std::string_view comment) {
  std::vector<std::string_view> parts;
  while (parts.size() < 4 && !comment.empty()) {
    const std::size_t end = std::min(comment.find(';'), comment.size());
    parts.push_back(trimmed(comment.substr(0, end)));
    comment.remove_prefix(std::min(end + 1, comment.size()));
  }
  if (parts.size() < 4 || parts[3].empty()) return;
  const auto id = parse_nastran_integer(parts[1]);
  if (!id) return;
  if (parts[2] == "SET") set_names_[*id] = {std::string(parts[3]), false};
  if (parts[2].starts_with('P') && parts[2] != "PART") property_names_[*id] = parts[3];
}

void NastranNames::read_property(std::int64_t id) {
  if (!pending_.empty()) property_names_[id] = std::exchange(pending_, {});
}

std::string NastranNames::property_name(std::int64_t id) const {
  if (const auto found = property_names_.find(id); found != property_names_.end()) {
    return found->second;
  }
  // A component whose elements are not listed stands for the property of its number.
  const auto found = component_names_.find(id);
  return found == component_names_.end() || !components_.empty() ? std::string() : found->second;
}

}  // namespace meshsmooth::formats

#include "foam_reader.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr std::string_view kPunctuation = "(){};";
constexpr std::string_view kBlanks = " \t\r\n";

template <class Int>
std::int64_t to_label(std::string bytes, bool swapped) {
  if (swapped) std::ranges::reverse(bytes);
  Int value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

}  // namespace

path foam_file(const path& folder, const std::string& name) {
  std::error_code error;
  const path plain = folder / name;
  const path compressed = folder / (name + ".gz");
  const bool is_compressed =
      !std::filesystem::exists(plain, error) && std::filesystem::exists(compressed, error);
  return is_compressed ? compressed : plain;
}

FoamReader::FoamReader(path file)
    : path_(std::move(file)), text_(read_bytes(path_)), scanner_(path_, text_) {
  read_header();
}

// --- words ---------------------------------------------------------------------

/// The next character that is no blank and in no comment; 0 at the end.
char FoamReader::peek() {
  const std::string_view text = text_;
  while (scanner_.position() < text.size()) {
    const std::size_t at = scanner_.position();
    std::size_t end = at;
    if (text.substr(at, 2) == "//") {
      end = std::min(text.find('\n', at), text.size());
    } else if (text.substr(at, 2) == "/*") {
      end = std::min(text.find("*/", at), text.size() - 2) + 2;
    } else if (kBlanks.find(text[at]) != std::string_view::npos) {
      end = std::min(text.find_first_not_of(kBlanks, at), text.size());
    } else {
      return text[at];
    }
    scanner_.bytes(end - at);
  }
  return 0;
}

std::string_view FoamReader::token() {
  const char first = peek();
  if (first == 0) scanner_.truncated();
  const std::string_view rest = std::string_view(text_).substr(scanner_.position());
  if (kPunctuation.find(first) != std::string_view::npos) return scanner_.bytes(1);
  if (first == '"') return scanner_.bytes(std::min(rest.find('"', 1), rest.size() - 1) + 1);
  return scanner_.bytes(std::min(rest.find_first_of(" \t\r\n(){};\""), rest.size()));
}

void FoamReader::expect(std::string_view wanted) {
  const std::string_view word = token();
  if (word != wanted) scanner_.refuse(wanted, word);
}

std::size_t FoamReader::count() {
  const std::string_view word = token();
  const auto value = scanner_.parse<std::size_t>(word);
  if (value > text_.size()) {
    fail("FILE_TRUNCATED", path_,
         "the file is too short for the " + std::string(word) + " things it announces");
  }
  return value;
}

// --- the header ----------------------------------------------------------------

void FoamReader::read_header() {
  if (peek() == 0) fail("FILE_TRUNCATED", path_, "the file is empty");
  expect("FoamFile");
  expect("{");
  for (std::string_view key = token(); key != "}"; key = token()) {
    const std::string_view value = token();
    if (key == "format") {
      is_binary_ = value == "binary";
      if (!is_binary_ && value != "ascii") scanner_.refuse("ascii or binary", value);
    }
    if (key == "class") is_compact_ = value == "faceCompactList";
    if (key == "arch") read_arch(value);
    skip_value(value);
  }
}

/// "LSB;label=32;scalar=64", in quotes.
void FoamReader::read_arch(std::string_view arch) {
  const auto width = [&](std::string_view name) -> std::size_t {
    const std::size_t at = arch.find(name);
    if (at == std::string_view::npos) return 0;
    const std::string_view bits = arch.substr(at + name.size(), 2);
    if (bits != "32" && bits != "64") scanner_.refuse("numbers of 32 or 64 bits", arch);
    return bits == "32" ? 4 : 8;
  };
  is_swapped_ = arch.find("MSB") != std::string_view::npos;
  if (const std::size_t label = width("label=")) label_width_ = label;
  if (const std::size_t scalar = width("scalar=")) scalar_width_ = scalar;
}

/// To the end of an entry of a dictionary; `first` is the word of it that was read. A dictionary
/// has no semicolon after it.
void FoamReader::skip_value(std::string_view first) {
  if (first == ";") return;
  for (int depth = first == "(" || first == "{" ? 1 : 0;;) {
    const std::string_view word = token();
    if (word == "{" || word == "(") ++depth;
    if (word == "}" || word == ")") --depth;
    if (depth < 0) scanner_.refuse(";", word);
    if (depth == 0 && (word == ";" || (word == "}" && first == "{"))) return;
  }
}

// --- lists ---------------------------------------------------------------------

std::int64_t FoamReader::binary_label(std::string_view bytes) const {
  return bytes.size() == 4 ? to_label<std::int32_t>(std::string(bytes), is_swapped_)
                           : to_label<std::int64_t>(std::string(bytes), is_swapped_);
}

/// What stands between the parentheses of a list.
std::vector<std::int64_t> FoamReader::list(std::size_t count) {
  std::vector<std::int64_t> values;
  if (count == 0 && peek() != '(') return values;  // binary: no parentheses
  values.reserve(count);
  expect("(");
  for (std::size_t index = 0; index < count; ++index) {
    values.push_back(is_binary_ ? binary_label(scanner_.bytes(label_width_)) : label(token()));
  }
  expect(")");
  return values;
}

/// Also "6{0}": six times the same.
std::vector<std::int64_t> FoamReader::labels() {
  const std::size_t size = count();
  if (peek() != '{') return list(size);
  expect("{");
  std::vector<std::int64_t> values(size, label(token()));
  expect("}");
  return values;
}

FoamFaces FoamReader::faces() {
  FoamFaces faces;
  if (is_compact_) {
    faces.first = labels();
    faces.nodes = labels();
    const auto count = static_cast<std::int64_t>(faces.nodes.size());
    if (faces.first.empty() || faces.first.front() != 0 || faces.first.back() != count ||
        !std::ranges::is_sorted(faces.first)) {
      scanner_.refuse("the places of the faces in their list", "others");
    }
    return faces;
  }
  const std::size_t face_count = count();
  expect("(");
  for (std::size_t face = 0; face < face_count; ++face) {
    const std::vector<std::int64_t> nodes = list(count());
    faces.nodes.insert(faces.nodes.end(), nodes.begin(), nodes.end());
    faces.first.push_back(static_cast<std::int64_t>(faces.nodes.size()));
  }
  expect(")");
  return faces;
}

CoordinateFields FoamReader::points() {
  CoordinateFields found;
  if (is_binary_) found.style = is_swapped_ ? NumberStyle::binary_swapped : NumberStyle::binary;
  const std::size_t node_count = count();
  if (node_count == 0) return found;
  expect("(");
  for (std::size_t node = 0; node < node_count; ++node) {
    std::array<std::string_view, 3> words;
    if (!is_binary_) expect("(");
    for (std::string_view& word : words) {
      word = is_binary_ ? scanner_.bytes(scalar_width_) : token();
    }
    if (!is_binary_) expect(")");
    found.add(static_cast<std::int64_t>(node), words, scanner_);
  }
  expect(")");
  return found;
}

// --- dictionaries --------------------------------------------------------------

std::vector<FoamEntry> FoamReader::entries() {
  std::vector<FoamEntry> entries;
  const std::size_t entry_count = count();
  if (entry_count == 0) return entries;
  expect("(");
  for (std::size_t index = 0; index < entry_count; ++index) entries.push_back(entry());
  expect(")");
  return entries;
}

/// List<bool>: flips of the faces of a zone, which do not matter here.
void FoamReader::skip_bytes_list() {
  const std::size_t size = count();
  if (is_binary_ && size > 0 && peek() == '(') {
    expect("(");
    scanner_.bytes(size);
    expect(")");
  }
  skip_value("");
}

/// A list of words whose first token was read: "2(wall heated)", also without its count or with
/// its type before it.
std::vector<std::string> FoamReader::words(std::string_view first) {
  while (first != "(") {
    if (first == ";" || first == "}") scanner_.refuse("(", first);
    first = token();
  }
  std::vector<std::string> words;
  for (std::string_view word = token(); word != ")"; word = token()) {
    if (kPunctuation.find(word.front()) != std::string_view::npos) scanner_.refuse(")", word);
    words.emplace_back(word);
  }
  expect(";");
  return words;
}

FoamEntry FoamReader::entry() {
  FoamEntry entry;
  entry.name = token();
  expect("{");
  for (std::string_view key = token(); key != "}"; key = token()) {
    if (peek() == '{') {  // a dictionary of its own
      int depth = 0;
      do {
        const std::string_view word = token();
        depth += word == "{" ? 1 : word == "}" ? -1 : 0;
      } while (depth > 0);
      continue;
    }
    const std::string_view value = token();
    if (key == "inGroups") {
      entry.groups = words(value);
    } else if (value == "List<label>") {
      entry.labels = labels();
      expect(";");
    } else if (value == "List<bool>") {
      skip_bytes_list();
    } else if (key.ends_with("Labels") &&
               value.find_first_not_of("0123456789") == std::string_view::npos) {
      entry.labels = list(scanner_.parse<std::size_t>(value));
      expect(";");
    } else {
      if (key == "type") entry.type = value;
      if (key == "neighbourPatch") entry.neighbour = value;
      if (key == "nFaces") entry.face_count = label(value);
      if (key == "startFace") entry.start_face = label(value);
      skip_value(value);
    }
  }
  return entry;
}

}  // namespace meshsmooth::formats

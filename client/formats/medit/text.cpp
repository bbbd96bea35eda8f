#include <array>
#include <cctype>
#include <string>

#include "medit/model.hpp"
#include "text.hpp"

namespace meshsmooth::formats::medit {
namespace {

constexpr char kComment = '#';
constexpr std::string_view kStart = "MeshVersionFormatted";

bool is_keyword(std::string_view word) {
  if (word.empty() || std::isalpha(static_cast<unsigned char>(word.front())) == 0) return false;
  return !same_word(word, "nan") && !same_word(word, "inf") && !same_word(word, "infinity");
}

class TextReader {
 public:
  TextReader(const std::filesystem::path& file, std::string_view text, Model& model)
      : file_(file), text_(text), scanner_(file, text, kComment), model_(model) {}

  void read() {
    const std::string_view start = scanner_.token();
    if (!same_word(start, kStart)) {
      refuse_foreign(file_, text_);
      scanner_.refuse(kStart, start);
    }
    const int version = scanner_.number<int>();
    if (version < 0 || version > 4) scanner_.refuse("a version up to 4", std::to_string(version));
    std::string_view word = next_word();
    while (!word.empty() && !same_word(word, "End")) {
      if (!is_keyword(word)) scanner_.refuse("a keyword after " + last_, word);
      last_ = word;
      word = read_section(word);
    }
    model_.has_end = !word.empty();
  }

 private:
  std::string_view next_word() { return scanner_.at_end() ? std::string_view() : scanner_.token(); }

  /// The word behind it; empty at the end of the file.
  std::string_view read_section(std::string_view name) {
    if (same_word(name, "Dimension")) {
      const std::string_view value = scanner_.token();
      if (value != "2" && value != "3") scanner_.refuse("dimension 2 or 3", value);
      model_.dimension = value == "2" ? 2 : 3;
      return next_word();
    }
    const Keyword* keyword = find_keyword(name);
    if (keyword == nullptr || keyword->role == Role::skipped) return skip_section(name);
    const std::size_t count = scanner_.count();
    switch (keyword->role) {
      case Role::vertices:
        read_vertices(count);
        break;
      case Role::refused:
        check_supported(file_, *keyword, count);
        return skip_section(name);
      default:
        read_rows(*keyword, count);
    }
    return next_word();
  }

  /// Up to the next keyword; texts in quotes hold none.
  std::string_view skip_section(std::string_view name) {
    bool any = false;
    for (std::string_view word = next_word(); !word.empty(); word = next_word()) {
      if (is_keyword(word)) return word;
      any = true;
      if (!word.starts_with('"')) continue;
      bool closed = word.size() > 1 && word.ends_with('"');
      while (!closed) {
        word = scanner_.token_on_line();
        closed = word.empty() || word.ends_with('"');
      }
    }
    if (!any) {
      fail("FILE_TRUNCATED", file_, "the file ends after the word " + std::string(name));
    }
    return {};
  }

  void read_vertices(std::size_t count) {
    if (model_.dimension == 0) scanner_.refuse("Dimension before Vertices", "");
    if (model_.has_vertices) scanner_.refuse("Vertices once", "Vertices");
    model_.has_vertices = true;
    for (std::size_t vertex = 0; vertex < count; ++vertex) {
      std::array<CoordinateFields::Field, 3> found{};
      std::array<double, 3> values{};
      for (std::size_t axis = 0; axis < static_cast<std::size_t>(model_.dimension); ++axis) {
        const std::string_view word = scanner_.token();
        values[axis] = scanner_.parse<double>(word);
        found[axis] = {scanner_.offset_of(word), word.size()};
      }
      model_.add_vertex(found, values);
      model_.vertex_references.push_back(scanner_.number<double>());
    }
  }

  void read_rows(const Keyword& keyword, std::size_t count) {
    const bool cells = keyword.role == Role::cells;
    const auto width = cells ? static_cast<std::size_t>(keyword.node_count) : 1;
    Section section{&keyword, {}, {}};
    for (std::size_t row = 0; row < count; ++row) {
      for (std::size_t number = 0; number < width; ++number) {
        section.numbers.push_back(scanner_.number<std::int64_t>());
      }
      if (cells) section.references.push_back(scanner_.number<double>());
    }
    model_.sections.push_back(std::move(section));
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  Scanner scanner_;
  Model& model_;
  std::string last_ = std::string(kStart);
};

}  // namespace

void read_text(const std::filesystem::path& file, std::string_view text, Model& model) {
  TextReader(file, text, model).read();
}

}  // namespace meshsmooth::formats::medit

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nastran/deck_lines.hpp"

namespace meshsmooth::formats {

/// One line of a card. Small fields have 8 columns, large ones (marked by "*") 16, and those of a
/// line with a comma are free. The first field holds the name or the mark of a continuation.
struct NastranCardLine {
  enum class Form : std::uint8_t { small, large, free };

  NastranLine line;
  Form form = Form::small;
  bool wide = false;  // four data fields in a line, not eight
  // Tabs go on to the next eighth column. Some decks have them between fields that fill theirs,
  // which are then one too far: there they may only separate.
  bool has_full_fields = false;
  bool tabs_separate = false;
  std::string expanded;  // with blanks in place of its tabs, where it has any

  /// Data fields between the first and the last field, which marks a continuation.
  [[nodiscard]] std::size_t field_count() const { return wide ? 4 : 8; }
  [[nodiscard]] std::string_view columns() const {
    return expanded.empty() ? line.text : std::string_view(expanded);
  }
  [[nodiscard]] std::size_t column_of(std::size_t field) const {
    return 8 + field * column_count();
  }
  [[nodiscard]] std::size_t column_count() const { return form == Form::large ? 16 : 8; }
  void separate_by_tabs();
  /// Without blanks around it; -1: the first field; `field_count()`: the last one.
  [[nodiscard]] std::string_view field(std::ptrdiff_t number) const;
  /// Where a data field stands in the bytes of the line.
  [[nodiscard]] CoordinateFields::Field locate(std::size_t field, const NastranLines& lines) const;

 private:
  [[nodiscard]] CoordinateFields::Field locate_columns(std::size_t field,
                                                       const NastranLines& lines) const;
};

/// An entry of the bulk data, with its continuations.
class NastranCard {
 public:
  std::string name;  // in capitals, without the star of large fields
  std::vector<NastranCardLine> lines;
  std::vector<std::string_view> comments;  // before it

  [[nodiscard]] const NastranLine& line() const { return lines.front().line; }
  /// Whether `separate_by_tabs` would change something.
  [[nodiscard]] bool has_full_fields_before_tabs() const;
  void separate_by_tabs();
  /// By number from 0, without the name; empty: blank, or not there.
  [[nodiscard]] std::string_view field(std::size_t number) const;
  [[nodiscard]] std::size_t field_count() const;
  /// Null: the card ends before it. `number` becomes that in the line.
  [[nodiscard]] const NastranCardLine* line_of(std::size_t& number) const;
};

/// What a deck has beside its bulk data.
class NastranControl {
 public:
  virtual ~NastranControl() = default;
  virtual void read_control_line(const NastranLine& line) = 0;
  /// "BEGIN BULK", "BEGIN SUPER=5": the text after BEGIN, in capitals.
  virtual void begin_section(std::string_view what) = 0;
};

/// Puts the lines of a deck together to the cards of its bulk data.
class NastranCards {
 public:
  NastranCards(NastranLines& lines, NastranControl& control);

  /// False at the end of the deck; comments behind the last card remain with the lines.
  bool next(NastranCard& card);

 private:
  bool read_next();
  bool take_control_line();
  [[nodiscard]] bool ends_here();

  NastranLines& lines_;
  NastranControl& control_;
  bool in_bulk_;
  bool has_card_ = false;
  std::vector<std::string_view> comments_;  // before it
  std::optional<std::string> section_;      // that begins with it
  std::optional<NastranCardLine> pending_;  // was read, and is of no card yet
};

/// "abc" as "ABC".
[[nodiscard]] std::string nastran_capitals(std::string_view text);

}  // namespace meshsmooth::formats

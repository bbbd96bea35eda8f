#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "content.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

/// A line of a deck, for messages.
struct DeckPlace {
  std::size_t file;
  std::size_t line;
};

/// "*NODE, NSET=all": names in capitals and without blanks, values as they stand, without quotes.
struct DeckKeyword {
  struct Parameter {
    std::string name;
    std::string value;
    std::size_t begin;  // in the file, with the comma before it
    std::size_t end;
  };

  std::string name;  // without the star
  std::vector<Parameter> parameters;
  DeckPlace place;

  [[nodiscard]] const Parameter* find(std::string_view wanted) const;
  /// Empty where it is not given.
  [[nodiscard]] std::string value(std::string_view wanted) const;
};

/// Walks over the lines of an Abaqus deck, through the files that it includes, and takes the text
/// apart for `FileContent::segments`. Comments and empty lines are no lines.
class DeckReader {
 public:
  explicit DeckReader(const std::filesystem::path& path);

  /// Moves to the next line; false at the end of the deck.
  bool next();
  [[nodiscard]] std::string_view line() const { return line_; }
  [[nodiscard]] bool at_keyword() const { return trimmed(line_).starts_with('*'); }
  /// The keyword that starts at this line; moves to its last line.
  [[nodiscard]] DeckKeyword keyword();
  /// Data lines of the keyword just read come from its parameter INPUT, where there is one.
  void read_input_of(const DeckKeyword& keyword);
  /// Keeps where the coordinates stand in this line; a missing word is null.
  void add_node(NodeId node, std::int64_t label, std::array<std::string_view, 3> words);

  [[nodiscard]] DeckPlace place() const;
  /// "line 12", with the file's name where it is an included one.
  [[nodiscard]] std::string describe(const DeckPlace& place) const;
  /// Of the main file.
  [[nodiscard]] std::string_view text() const { return texts_.front(); }
  [[noreturn]] void fail_at(const DeckPlace& place, const std::string& what,
                            const std::string& reason = "FORMAT_ERROR") const;
  [[noreturn]] void refuse(std::string_view expected, std::string_view found) const;
  [[noreturn]] void truncated(const std::string& what) const;
  /// Of a number in this line.
  [[nodiscard]] std::int64_t label(std::string_view word) const;

  /// At the end of the deck.
  void store(FileContent& content);

 private:
  struct Source {
    std::size_t file;
    std::size_t reading;  // from 1, through the deck
    Scanner scanner;
    std::string_view text;
    std::size_t line = 1;
    bool started = false;  // stands at a line that was read
    std::size_t segment_begin = 0;
    CoordinateFields fields = {};
    std::vector<NodeId> nodes = {};
  };

  void open(const std::filesystem::path& path);
  void close_segment(Source& source, std::size_t end, bool directive);
  void include(const DeckKeyword& keyword);
  void consume(Source& source);
  [[nodiscard]] std::filesystem::path find_included(const std::string& name) const;

  std::deque<std::string> texts_;  // whose views must stay
  std::vector<std::filesystem::path> files_;
  std::vector<std::size_t> node_readings_;  // by file, the one that found nodes in it; 0: none
  std::vector<Source> sources_;             // this file and those that include it
  std::vector<TextSegment> segments_;
  std::string_view line_;
  std::optional<DeckKeyword::Parameter> pending_;  // an INPUT whose file is next
};

/// Parts between commas, without blanks behind.
void split_data(std::string_view line, std::vector<std::string_view>& parts);
[[nodiscard]] std::string in_capitals(std::string_view text);

}  // namespace meshsmooth::formats

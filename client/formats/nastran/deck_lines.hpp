#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "content.hpp"

namespace meshsmooth::formats {

/// A line of a Nastran deck without its comment, its end and the blanks before that.
struct NastranLine {
  std::string_view text;
  std::uint32_t file;
  std::uint32_t number;  // in its file, from 1
  std::size_t segment;   // of the deck's text
  std::size_t blanks;    // that follow the text; 0 before a comment

  [[nodiscard]] bool same_segment(const NastranLine& other) const {
    return segment == other.segment;
  }
};

/// Walks over the lines of a deck, through the files that it includes, and takes the text apart for
/// `FileContent::segments`. Lines that have nothing but a comment are no lines.
class NastranLines {
 public:
  explicit NastranLines(const std::filesystem::path& path);

  /// Moves to the next line; false at the end of the deck.
  bool next();
  [[nodiscard]] const NastranLine& line() const { return line_; }
  /// The comments since the last call, without their "$".
  [[nodiscard]] const std::vector<std::string_view>& comments() const { return comments_; }
  void forget_comments() { comments_.clear(); }
  /// Reads no more: what follows remains as text.
  void stop();
  /// Whether a file that includes this one has more lines.
  [[nodiscard]] bool is_continued_elsewhere() const;
  [[nodiscard]] std::string_view main_text() const { return texts_.front(); }
  [[nodiscard]] const std::filesystem::path& main_file() const { return files_.front(); }

  /// Keeps where the coordinates of a node stand: in the segment of `line`, counted from its start.
  void add_fields(const NastranLine& line, std::int64_t id,
                  const std::array<CoordinateFields::Field, 3>& fields, const Vec3d& read,
                  NodeId node);
  /// Counted from the start of its segment.
  [[nodiscard]] std::size_t offset_of(const NastranLine& line, const char* at) const;

  [[noreturn]] void fail_at(std::uint32_t file, std::uint32_t line, const std::string& what,
                            const std::string& reason = "FORMAT_ERROR") const;
  [[noreturn]] void refuse(const NastranLine& line, const std::string& expected,
                           std::string_view found) const;

  /// At the end. `numbers`: by the nodes that were added, those of the mesh; empty: the same.
  void store(FileContent& content, const std::vector<NodeId>& numbers);

 private:
  struct Reading {
    std::uint32_t file;
    std::string_view text;
    std::size_t position = 0;
    std::uint32_t line = 0;
  };
  struct Segment {
    std::string_view text;  // from its start; to its end when it is closed
    std::size_t index;      // of its reading, counted through the deck
    TextSegment stored;
  };

  void open(const std::filesystem::path& path);
  static void share_digits(std::vector<TextSegment>& segments);
  void begin_segment(bool directive);
  void end_segment(std::size_t end);
  std::string_view take_line();
  bool is_include(std::string_view line, std::string_view& rest) const;
  void include(std::size_t begin, std::string_view rest);
  std::string included_name(std::string_view rest, std::uint32_t first_line);
  [[nodiscard]] std::filesystem::path find_included(const std::string& name, std::uint32_t line);

  std::deque<std::string> texts_;  // whose views must stay
  std::vector<std::filesystem::path> files_;
  std::vector<std::size_t> node_readings_;  // by file, the one that found nodes in it; 0: none
  std::vector<Reading> readings_;           // this file and those that include it
  std::vector<std::size_t> open_;           // segments, of the same
  std::deque<Segment> segments_;
  NastranLine line_ = {};
  std::vector<std::string_view> comments_;
};

}  // namespace meshsmooth::formats

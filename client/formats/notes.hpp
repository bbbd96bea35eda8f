#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace meshsmooth::formats {

/// What a reader tolerated in a file, one line a kind: the first of them, and how many more.
class Notes {
 public:
  /// `describe` makes the text of the first one of its kind, and is not called for others.
  template <class Describe>
  void add(std::string_view kind, Describe describe) {
    for (Note& note : notes_) {
      if (note.kind != kind) continue;
      ++note.count;
      return;
    }
    notes_.push_back({kind, describe(), 1});
  }

  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> texts;
    for (const Note& note : notes_) {
      texts.push_back(note.first);
      if (note.count > 1) texts.back() += " (and " + std::to_string(note.count - 1) + " more)";
    }
    return texts;
  }

 private:
  struct Note {
    std::string_view kind;  // a literal
    std::string first;
    std::int64_t count;
  };
  std::vector<Note> notes_;
};

}  // namespace meshsmooth::formats

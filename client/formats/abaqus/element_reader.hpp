#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "deck_reader.hpp"
#include "model.hpp"
#include "notes.hpp"

namespace meshsmooth::formats {

/// Reads the data lines of *ELEMENT into a model.
class ElementReader {
 public:
  ElementReader(DeckReader& reader, AbaqusModel& model, Notes& notes)
      : reader_(reader), model_(model), notes_(notes) {}

  /// Moves past the keyword and its elements; false at the end of the deck.
  bool read(const DeckKeyword& keyword, AbaqusModel::ScopeId scope);
  /// *USER ELEMENT: how many nodes a type of the user's has.
  void define(const DeckKeyword& keyword);

 private:
  struct Block {  // the elements of one keyword
    std::string type_name;
    AbaqusElement type;
    std::string set;
    AbaqusModel::ScopeId scope;
  };
  /// A data line of elements that end where their lines do.
  struct Row {
    DeckPlace place;
    std::vector<std::int64_t> numbers;  // 0: none
    bool continued;                     // ends with a comma
  };

  bool read_counted(const Block& block);
  bool read_rows(const Block& block);
  void join_rows(const Block& block, const std::vector<Row>& rows);
  void read_corners(std::int64_t label, const Block& block, std::vector<std::int64_t>& nodes);
  [[nodiscard]] std::int64_t read_corner(std::string_view word, bool may_be_none) const;
  void add(const Block& block, std::int64_t label, const std::vector<std::int64_t>& nodes,
           DeckPlace place);

  DeckReader& reader_;
  AbaqusModel& model_;
  Notes& notes_;
  std::map<std::string, int> user_types_;             // nodes by name
  std::map<std::string, std::set<std::size_t>> met_;  // numbers of nodes by held type
  std::vector<std::string_view> words_;
};

}  // namespace meshsmooth::formats

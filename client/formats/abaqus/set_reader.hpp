#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "deck_reader.hpp"
#include "model.hpp"

namespace meshsmooth::formats {

/// Reads the data lines of sets, and of what else names nodes and elements by label or set, into a
/// model. Each function moves past its keyword and data lines; false at the end of the deck.
class SetReader {
 public:
  using Kind = AbaqusModel::Kind;
  using ScopeId = AbaqusModel::ScopeId;

  SetReader(DeckReader& reader, AbaqusModel& model) : reader_(reader), model_(model) {}

  bool read_set(const DeckKeyword& keyword, Kind kind, ScopeId own);
  /// A line names an element or a set of them, and the number of their sides, "S2", which in shells
  /// are their faces and edges, or of their edges, "E2". Surfaces of nodes and of all free sides
  /// lie on the boundary.
  bool read_surface(const DeckKeyword& keyword, ScopeId scope);
  /// Of each equation a line with the number of its terms, then the terms, several a line: a node
  /// or a set, a degree of freedom, a factor. What else stands there is the solver's affair.
  bool read_equations(ScopeId scope);

 private:
  [[nodiscard]] std::int64_t term_count() const;
  /// "first, last[, step]".
  AbaqusModel::Range read_range();
  /// A label or the name of another set, in an instance: "wing-1.12", "wing-1.tip".
  AbaqusModel::Entry read_member(std::string_view word, Kind kind, ScopeId scope);

  DeckReader& reader_;
  AbaqusModel& model_;
  std::vector<std::string_view> words_;
};

}  // namespace meshsmooth::formats

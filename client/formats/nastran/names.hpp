#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nastran/cards.hpp"
#include "nastran/ids.hpp"

namespace meshsmooth::formats {

/// Sets of a deck, and the names that preprocessors give its properties and sets in comments:
/// HyperMesh, ANSA, Femap, Patran, NX.
class NastranNames {
 public:
  struct Set {
    std::string name;
    bool of_elements;
    IdList ids;
  };

  /// A line of case control, for "SET n = …".
  void read_control_line(const NastranLine& line);
  void read_comment(std::string_view comment);
  /// SET1 or SET3. False: a word in it is no id.
  bool read_set(const NastranCard& card);
  /// A card that starts with P: takes the name that a comment before it gave.
  void read_property(std::int64_t id);

  /// By property; empty: it has no name.
  [[nodiscard]] std::string property_name(std::int64_t id) const;
  /// All, under the names of comments where they have some.
  [[nodiscard]] std::vector<Set> sets() const;

 private:
  struct NumberedSet {
    std::string card;  // "SET", "SET1", "SET3"
    std::int64_t id;
    bool of_elements;
    IdList ids;
  };
  struct NameOfSet {
    std::string name;
    bool of_elements;
  };

  void finish_control_set();
  void name_property(std::optional<std::int64_t> id, std::string_view name);
  void read_hypermesh(std::string_view comment);
  void read_ansa(std::string_view comment);

  std::vector<NumberedSet> sets_;
  std::map<std::int64_t, std::string> property_names_;
  std::map<std::int64_t, std::string> component_names_;
  std::map<std::int64_t, NameOfSet> set_names_;
  std::map<std::int64_t, IdList> components_;  // the elements of HyperMesh's
  std::optional<std::int64_t> moving_to_;      // the component whose elements are listed
  std::string pending_;                        // the name of the next property
  std::string control_set_;                    // that is being read
};

}  // namespace meshsmooth::formats

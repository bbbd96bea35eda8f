#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace meshsmooth::formats {

/// How a card of Nastran's connects grid points.
struct NastranElement {
  enum class Role : std::uint8_t {
    mesh,      // an element that can be smoothed
    held,      // one that cannot: interfaces, infinite elements, those with other numbers of nodes
    line,      // bars, rods and springs between two grid points
    points,    // masses, rigid elements, connectors: they hold their grid points
    no_nodes,  // tells of no grid points
  };

  std::string_view name;
  Role role;
  int linear_type;  // VTK's, of the corners alone
  int second_type;  // with all nodes in the middle; 0: it has none
  std::uint8_t corners;
  std::uint8_t nodes;  // at most
  std::uint8_t first;  // the field of the first node; of `line` and `points` see `fields`
  std::string_view fields =
      {};  // letters: the fields of the nodes ("C": the third, from "A"); "": all
};

/// Null: no such card is known. O(log cards).
[[nodiscard]] const NastranElement* find_nastran_element(std::string_view name);
/// Whether it starts with C and is no element: coordinate systems, loads, aerodynamics …
[[nodiscard]] bool is_other_nastran_card(std::string_view name);

}  // namespace meshsmooth::formats

// Cards that are attached to grid points: springs, masses, rigid elements, and those not known.

#include <algorithm>
#include <utility>

#include "nastran/model.hpp"
#include "nastran/numbers.hpp"

namespace meshsmooth::formats {

/// Words that are no ids are left out; ids of no grid points are left out later.
void NastranModel::add_points(const NastranCard& card, const NastranElement& type) {
  if (type.role == NastranElement::Role::no_nodes) return;
  for (const char letter : type.fields) {
    const auto id = parse_nastran_integer(card.field(static_cast<std::size_t>(letter - 'A')));
    if (id && *id > 0) corners_.push_back(*id);
  }
  if (!type.fields.empty()) return;
  bool thru = false;
  const std::size_t first = corners_.size();
  for (std::size_t field = type.first; field < card.field_count(); ++field) {
    if (field == 2 && card.name == "RBE2") continue;  // components
    const std::string_view word = card.field(field);
    const auto id = parse_nastran_integer(word);
    if (id && *id > 0) {
      if (std::exchange(thru, false)) corners_.back() = -corners_.back();
      corners_.push_back(*id);
    } else if (!word.empty()) {
      thru = corners_.size() > first && nastran_capitals(word) == "THRU";
    }
  }
}

/// RBE3: groups of a weight, components and grid points; behind UM, grid points with components.
void NastranModel::add_weighted_points(const NastranCard& card) {
  if (const auto id = parse_nastran_integer(card.field(2)); id && *id > 0) corners_.push_back(*id);
  bool behind_um = false;
  bool components = false;  // are next
  for (std::size_t field = 4; field < card.field_count(); ++field) {
    const std::string_view word = card.field(field);
    if (word.empty()) continue;
    const auto id = parse_nastran_integer(word);
    if (id && std::exchange(components, false)) continue;
    if (id && *id > 0) {
      corners_.push_back(*id);
      components = behind_um;
    } else if (nastran_capitals(word) == "UM") {
      behind_um = true;
    } else if (nastran_capitals(word) == "ALPHA") {
      return;
    } else {
      components = !behind_um;  // behind a weight
    }
  }
}

void NastranModel::add_unknown(const NastranCard& card) {
  const auto known =
      std::ranges::find(unknown_types_, std::string_view(card.name), &NastranElement::name);
  const NastranElement* type = known == unknown_types_.end() ? nullptr : &*known;
  if (type == nullptr) {
    unknown_names_.push_back(card.name);
    unknown_types_.push_back({unknown_names_.back(), NastranElement::Role::held, 0, 0, 0, 0, 1});
    type = &unknown_types_.back();
  }
  const auto id = parse_nastran_integer(card.field(0));
  if (!id || *id < 1) return;  // elements have one
  const NastranLine& line = card.line();
  elements_.push_back({type,
                       *id,
                       0,
                       0,
                       corners_.size(),
                       {line.file, line.number},
                       static_cast<std::uint32_t>(scope_)});
  add_points(card, *type);
}

}  // namespace meshsmooth::formats

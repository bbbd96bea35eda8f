#include "nastran/model.hpp"

#include <algorithm>

#include "cells.hpp"
#include "nastran/numbers.hpp"

namespace meshsmooth::formats {
namespace {

/// Whether the fields behind the coordinates, and that of the system, may be such.
bool may_be_grid(const NastranCard& card) {
  for (const std::size_t field : {0, 1, 5, 6, 7}) {
    const std::string_view word = card.field(field);
    if (!word.empty() && !parse_nastran_integer(word)) return false;
  }
  return true;
}

bool has_corners(const NastranCard& card, const NastranElement& type) {
  for (std::size_t node = 0; node < type.corners; ++node) {
    if (card.field(type.first + node).empty()) return false;
  }
  return true;
}

/// "CTETRA 5".
std::string called(const NastranCard& card, std::int64_t id) {
  return card.name + " " + std::to_string(id);
}

}  // namespace

void NastranModel::enter_scope(const std::string& name) {
  const auto known = std::ranges::find(scopes_, name, &Scope::name);
  scope_ = static_cast<std::size_t>(known - scopes_.begin());
  if (known == scopes_.end()) scopes_.emplace_back().name = name;
}

std::int64_t NastranModel::id_of(const NastranCard& card, std::size_t field,
                                 const char* what) const {
  const std::string_view word = card.field(field);
  const auto id = parse_nastran_integer(word);
  if (!id || *id < 1) {
    lines_.refuse(card.line(), std::string(what) + " of " + card.name + ", a number above 0", word);
  }
  return *id;
}

std::int64_t NastranModel::id_or(const NastranCard& card, std::size_t field,
                                 std::int64_t otherwise) const {
  const std::string_view word = card.field(field);
  if (word.empty()) return otherwise;
  const auto id = parse_nastran_integer(word);
  if (!id || *id < 0) {
    lines_.refuse(card.line(),
                  "a whole number in field " + std::to_string(field + 2) + " of " + card.name,
                  word);
  }
  return *id;
}

double NastranModel::real_of(const NastranCard& card, std::size_t field) const {
  const std::string_view word = card.field(field);
  const auto value = parse_nastran_real(word);
  if (!value) {
    lines_.refuse(card.line(),
                  "a number in field " + std::to_string(field + 2) + " of " + card.name, word);
  }
  return *value;
}

// --- grid points --------------------------------------------------------------------

void NastranModel::add_grid(NastranCard& card) {
  if (card.has_full_fields_before_tabs() && !may_be_grid(card)) card.separate_by_tabs();
  constexpr std::size_t kX = 2;
  const std::int64_t id = id_of(card, 0, "the id");
  const std::int64_t system = id_or(card, 1, kBlank);
  const NastranLine& line = card.line();
  const auto grid = static_cast<NodeId>(grids_.size());
  const Vec3d read = {real_of(card, kX), real_of(card, kX + 1), real_of(card, kX + 2)};
  std::array<CoordinateFields::Field, 3> fields{};
  for (std::size_t axis = 0; axis < fields.size(); ++axis) {
    std::size_t number = kX + axis;
    if (const NastranCardLine* own = card.line_of(number)) {
      fields[axis] = own->locate(number, lines_);
      continue;
    }
    const NastranCardLine& last = card.lines.back();  // of large fields, without a continuation
    fields[axis].begin = lines_.offset_of(line, last.line.text.data() + last.line.text.size());
    fields[axis].missing = true;
    fields[axis].in_next_line = true;
    const bool free = last.form == NastranCardLine::Form::free;
    fields[axis].columns = free ? 0 : static_cast<std::uint8_t>(last.column_count());
  }
  lines_.add_fields(line, id, fields, read, grid);
  Scope& scope = scopes_[scope_];
  scope.ids.push_back(id);
  scope.grids.push_back(grid);
  grids_.push_back({id, system, {line.file, line.number}, static_cast<std::uint32_t>(scope_)});
  local_.push_back(read);
}

void NastranModel::add_grid_defaults(const NastranCard& card) {
  scopes_[scope_].default_system = id_or(card, 1, 0);
}

// --- coordinate systems ---------------------------------------------------------------

bool NastranModel::add_system(const NastranCard& card) {
  const std::string& name = card.name;  // CORD2R
  if (name.size() != 6 || !name.starts_with("CORD") || (name[4] != '1' && name[4] != '2')) {
    return false;
  }
  constexpr std::string_view kKinds = "RCS";
  const std::size_t kind = kKinds.find(name[5]);
  if (kind == std::string_view::npos) return false;
  CoordinateSystems::Definition definition{};
  definition.kind = static_cast<CoordinateFrame::Kind>(kind);
  definition.by_nodes = name[4] == '1';
  if (!definition.by_nodes) {
    definition.id = id_of(card, 0, "the id");
    definition.reference = id_or(card, 1, 0);
    std::size_t field = 2;
    for (Vec3d& point : definition.points) {
      point = {real_of(card, field), real_of(card, field + 1), real_of(card, field + 2)};
      field += 3;
    }
    define(card, definition);
    return true;
  }
  for (std::size_t first = 0; first <= 4; first += 4) {  // two may share a card
    if (first > 0 && card.field(first).empty()) continue;
    definition.id = id_of(card, first, "the id");
    for (std::size_t grid = 0; grid < 3; ++grid) {
      definition.grids[grid] = id_of(card, first + grid + 1, "a grid point");
    }
    define(card, definition);
  }
  return true;
}

void NastranModel::define(const NastranCard& card,
                          const CoordinateSystems::Definition& definition) {
  const auto [known, is_new] =
      scopes_[scope_].systems.emplace(definition.id, systems_.systems.size());
  if (!is_new) {
    if (systems_.systems[known->second].definition == definition) return;
    lines_.fail_at(card.line().file, card.line().number,
                   "the coordinate system " + std::to_string(definition.id) +
                       " is defined twice, first in line " +
                       std::to_string(system_places_[known->second].line));
  }
  systems_.systems.push_back({definition});
  system_places_.push_back({card.line().file, card.line().number});
}

std::vector<NodeId> NastranModel::system_nodes() const {
  std::vector<NodeId> nodes;
  for (const CoordinateSystems::System& system : systems_.systems) {
    if (!system.definition.by_nodes || !system.is_complete) continue;
    nodes.insert(nodes.end(), system.nodes.begin(), system.nodes.end());
  }
  return nodes;
}

// --- elements -----------------------------------------------------------------------

void NastranModel::add_element(NastranCard& card, const NastranElement& type) {
  if (card.has_full_fields_before_tabs() && !has_corners(card, type)) card.separate_by_tabs();
  const std::int64_t id = id_of(card, 0, "the id");
  const NastranLine& line = card.line();
  const std::int64_t property =
      type.role == NastranElement::Role::mesh || type.role == NastranElement::Role::held ||
              (type.role == NastranElement::Role::line && type.fields == "CD")
          ? id_or(card, 1, id)
          : 0;
  // CTRIAX6 has its material in the place of a property.
  const std::int64_t material = card.name == "CTRIAX6" ? property : 0;
  const Place place = {line.file, line.number};
  const auto scope = static_cast<std::uint32_t>(scope_);
  elements_.push_back({&type, id, property, material, corners_.size(), place, scope});
  if (type.role == NastranElement::Role::mesh) {
    add_corners(card, type);
  } else if (card.name == "RBE3") {
    add_weighted_points(card);
  } else {
    add_points(card, type);
  }
  if (card.name == "PLOTEL" && !card.field(4).empty()) {  // two may share a card
    elements_.push_back({&type, id_of(card, 4, "the id"), 0, 0, corners_.size(), place, scope});
    for (const std::size_t field : {5, 6}) corners_.push_back(id_of(card, field, "a grid point"));
  }
}

/// A tenth field in the last line that marks no continuation would be left out.
void NastranModel::check_fields(const NastranCard& card) const {
  const NastranCardLine& line = card.lines.back();
  const std::string_view mark = line.field(static_cast<std::ptrdiff_t>(line.field_count()));
  if (line.form != NastranCardLine::Form::free || mark.starts_with('+') ||
      !parse_nastran_integer(mark)) {
    return;
  }
  const std::string most = "at most " + std::to_string(line.field_count());
  lines_.refuse(line.line,
                most + " fields behind the name; others go into a next line, behind a comma", mark);
}

/// Nodes in the middle may be blank, or not be there. Gmsh writes solids with more nodes than
/// Nastran has, on their faces.
void NastranModel::add_corners(const NastranCard& card, const NastranElement& type) {
  constexpr std::array<std::size_t, 6> kAlternating = {0, 2, 4, 1, 3, 5};
  const bool alternating = card.name == "CTRIAX6";
  const std::size_t first = corners_.size();
  bool any_in_middle = false;
  check_fields(card);
  for (std::size_t node = 0; node < type.nodes; ++node) {
    const std::size_t field = type.first + (alternating ? kAlternating[node] : node);
    const std::int64_t id = id_or(card, field, 0);
    if (id == 0 && node < type.corners) {
      lines_.fail_at(card.line().file, card.line().number,
                     called(card, elements_.back().id) + " has " +
                         std::to_string(corners_.size() - first) + " of its " +
                         std::to_string(type.corners) + " corners");
    }
    any_in_middle = any_in_middle || (id != 0 && node >= type.corners);
    corners_.push_back(id);
  }
  if (!any_in_middle) corners_.resize(first + type.corners);
  if (find_vtk_cell(type.linear_type)->dimension < 3) return;
  for (std::size_t field = type.first + type.nodes; field < card.field_count(); ++field) {
    if (const std::int64_t id = id_or(card, field, 0); id != 0) corners_.push_back(id);
  }
}

void NastranModel::add_material(std::int64_t property, std::int64_t material) {
  materials_[property] = material;
}

void NastranModel::fail_at(const Place& place, const std::string& what) const {
  lines_.fail_at(place.file, place.line, what);
}

}  // namespace meshsmooth::formats

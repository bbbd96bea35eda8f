// What the cards of a deck mean, when all are known.

#include <algorithm>
#include <array>
#include <memory>
#include <span>

#include "cells.hpp"
#include "nastran/model.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {
// --- nodes --------------------------------------------------------------------------

std::optional<NodeId> NastranModel::find_node(const Scope& scope, std::int64_t id) const {
  const auto place = scope.index.find(id);
  if (!place) return std::nullopt;
  const NodeId grid = scope.grids[*place];
  return node_of_grid_.empty() ? grid : node_of_grid_[static_cast<std::size_t>(grid)];
}

/// A GRID may be there again if it says the same.
void NastranModel::number_grids() {
  bool repeated = false;
  std::vector<NodeId> first(grids_.size());
  for (Scope& scope : scopes_) {
    scope.index = IdIndex(scope.ids);
    for (std::size_t place = 0; place < scope.ids.size(); ++place) {
      const auto own = static_cast<std::size_t>(scope.grids[place]);
      const auto original =
          static_cast<std::size_t>(scope.grids[*scope.index.find(scope.ids[place])]);
      first[own] = static_cast<NodeId>(original);
      if (original == own) continue;
      repeated = true;
      if (local_[own] == local_[original] && grids_[own].system == grids_[original].system)
        continue;
      fail_at(grids_[own].place, "GRID " + std::to_string(grids_[own].id) +
                                     " is there again with other coordinates, first in line " +
                                     std::to_string(grids_[original].place.line));
    }
  }
  if (repeated) {
    NodeId next = 0;
    node_of_grid_.resize(grids_.size());
    for (std::size_t grid = 0; grid < grids_.size(); ++grid) {
      const auto original = static_cast<std::size_t>(first[grid]);
      node_of_grid_[grid] = original == grid ? next++ : node_of_grid_[original];
    }
  }
  for (std::size_t grid = 0; grid < grids_.size(); ++grid) {
    if (first[grid] != static_cast<NodeId>(grid)) continue;
    const Grid& own = grids_[grid];
    Scope& scope = scopes_[own.scope];
    const std::int64_t id = own.system == kBlank ? scope.default_system : own.system;
    std::int32_t system = CoordinateSystems::kBasic;
    if (id != 0) {
      const auto found = scope.systems.find(id);
      if (found == scope.systems.end()) {
        fail_at(own.place, "GRID " + std::to_string(own.id) + " is in the coordinate system " +
                               std::to_string(id) + ", which is not in the deck");
      }
      system = static_cast<std::int32_t>(found->second);
    }
    node_ids_.push_back(own.id);
    systems_.of_node.push_back(system);
    systems_.local.push_back(local_[grid]);
  }
}

void NastranModel::link_systems() {
  for (const Scope& scope : scopes_) {
    for (const auto& [id, place] : scope.systems) {
      CoordinateSystems::System& system = systems_.systems[place];
      const CoordinateSystems::Definition& definition = system.definition;
      if (definition.by_nodes) {
        for (std::size_t grid = 0; grid < definition.grids.size(); ++grid) {
          const auto node = find_node(scope, definition.grids[grid]);
          system.is_complete = system.is_complete && node.has_value();
          system.nodes[grid] = node.value_or(0);
        }
      } else if (definition.reference != 0) {
        const auto found = scope.systems.find(definition.reference);
        system.is_complete = found != scope.systems.end();
        if (system.is_complete) system.reference = static_cast<std::int32_t>(found->second);
      }
    }
  }
}

std::vector<Vec3d> NastranModel::make_positions() {
  return systems_.basic_positions([&](std::size_t system, const char* why) {
    fail_at(system_places_[system], "the coordinate system " +
                                        std::to_string(systems_.systems[system].definition.id) +
                                        " " + why);
  });
}

// --- cells --------------------------------------------------------------------------

std::size_t NastranModel::end_of(std::size_t element) const {
  return element + 1 < elements_.size() ? elements_[element + 1].first : corners_.size();
}

/// One that has some of its nodes in the middle is held.
void NastranModel::add_mesh_cell(const Element& element, PlainDataset& dataset) {
  const NastranElement& type = *element.type;
  const auto left_out = static_cast<std::size_t>(std::ranges::count(nodes_, -1));
  const std::size_t given = nodes_.size() - left_out;
  int cell = given == type.corners ? type.linear_type : type.second_type;
  const bool without_centre = type.second_type == kQuad9Cell && given == 8 && nodes_.back() == -1;
  if (without_centre) cell = kQuad8Cell;
  std::erase(nodes_, -1);
  if (given != type.corners && given != type.nodes && !without_centre) {
    const std::string most = given < type.nodes ? " of " + std::to_string(type.nodes) : "";
    cell = dataset.own_type(std::string(type.name) + " with " + std::to_string(given) + most +
                            " nodes");
    dataset.add_cell(cell, nodes_);
    return;
  }
  std::array<std::int64_t, kMaxCellNodes> ordered{};
  std::size_t count = 0;
  // Nastran's order is that of Exodus.
  for (const std::int8_t place : places_in(NodeOrder::exodus, *find_vtk_cell(cell, given))) {
    ordered[count++] = nodes_[static_cast<std::size_t>(place)];
  }
  dataset.add_cell(cell, std::span(ordered).first(count));
}

/// In the main model, or in the element's own: ids of no grid points are scalar points.
void NastranModel::add_other_cell(const Element& element, std::size_t end, PlainDataset& dataset) {
  const Scope& scope = scopes_[element.scope];
  nodes_.clear();
  std::vector<std::int64_t> ids;
  for (std::size_t corner = element.first; corner < end; ++corner) {
    ids.clear();
    if (corners_[corner] < 0 && corner + 1 < end) {
      scope.index.append_range(-corners_[corner], corners_[corner + 1], ids);
      ++corner;
    } else {
      ids.push_back(corners_[corner]);
    }
    for (const std::int64_t id : ids) {
      if (const auto node = find_node(scope, id)) nodes_.push_back(*node);
    }
  }
  if (nodes_.empty()) return;
  int type = kPolyVertexCell;
  if (element.type->role == NastranElement::Role::held) {
    type = dataset.own_type(element.type->name);
  } else if (nodes_.size() <= 2) {
    type = nodes_.size() == 1 ? kVertexCell : kLineCell;
  } else if (element.type->name == "CBEAM3" && nodes_.size() == 3) {
    type = kEdge3Cell;
  }
  dataset.add_cell(type, nodes_);
}

void NastranModel::store_cells(FileContent& content, PlainDataset& dataset) {
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    if (repeated_.contains(index)) continue;
    const Element& element = elements_[index];
    const auto before = dataset.cell_count();
    if (element.type->role != NastranElement::Role::mesh) {
      add_other_cell(element, end_of(index), dataset);
    } else {
      nodes_.clear();
      const Scope& scope = scopes_[element.scope];
      for (std::size_t corner = element.first; corner < end_of(index); ++corner) {
        const std::int64_t id = corners_[corner];
        const auto node = id == 0 ? std::optional<NodeId>(-1) : find_node(scope, id);
        if (!node) {
          fail_at(element.place, std::string(element.type->name) + " " +
                                     std::to_string(element.id) + " uses node " +
                                     std::to_string(id) + ", which is not in the deck");
        }
        nodes_.push_back(*node);
      }
      add_mesh_cell(element, dataset);
    }
    if (dataset.cell_count() == before) continue;
    cell_elements_.push_back(index);
    content.cell_ids.push_back(element.id);
  }
}

/// Of elements that can be smoothed an id stands for one; it may be there again as it was.
void NastranModel::find_repeated_elements() {
  std::vector<std::size_t> order;
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    if (elements_[index].type->role == NastranElement::Role::mesh) order.push_back(index);
  }
  const auto key = [&](std::size_t index) {
    return std::pair(elements_[index].scope, elements_[index].id);
  };
  if (!std::ranges::is_sorted(order, {}, key)) std::ranges::stable_sort(order, {}, key);
  const auto corners = [&](std::size_t index) {
    return std::span(corners_).subspan(elements_[index].first,
                                       end_of(index) - elements_[index].first);
  };
  for (std::size_t place = 1; place < order.size(); ++place) {
    const std::size_t before = order[place - 1];
    const std::size_t index = order[place];
    if (key(before) != key(index)) continue;
    const Element& element = elements_[index];
    if (element.type == elements_[before].type && element.property == elements_[before].property &&
        std::ranges::equal(corners(before), corners(index))) {
      repeated_.insert(index);
      continue;
    }
    fail_at(element.place, std::string(element.type->name) + " " + std::to_string(element.id) +
                               " has the id of another element, in line " +
                               std::to_string(elements_[before].place.line));
  }
}

void NastranModel::store(const NastranNames& names, FileContent& content) {
  number_grids();
  link_systems();
  const auto dataset = std::make_shared<PlainDataset>();
  dataset->set_positions(make_positions());
  find_repeated_elements();
  store_cells(content, *dataset);
  store_columns(content, *dataset);
  store_groups(names, content, *dataset);
  store_sets(names, content);
  content.dataset = dataset;
  if (std::ranges::any_of(systems_.of_node,
                          [](auto of) { return of != CoordinateSystems::kBasic; })) {
    content.systems = std::make_shared<const CoordinateSystems>(systems_);
  }
}

}  // namespace meshsmooth::formats

// What hangs on the cells and nodes of a deck: ids, properties, materials, sets.

#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include "cells.hpp"
#include "nastran/model.hpp"

namespace meshsmooth::formats {
namespace {

Column to_column(const char* name, const std::vector<std::int64_t>& values) {
  return {name, true, {values.begin(), values.end()}};
}

bool are_unique(std::vector<std::int64_t> ids) {
  std::ranges::sort(ids);
  return std::ranges::adjacent_find(ids) == ids.end();
}

}  // namespace

void NastranModel::store_columns(FileContent& content, PlainDataset& dataset) const {
  Column properties{kEntityArray, true, {}};
  Column materials{kNastranMaterialArray, true, {}};
  bool any_material = false;
  for (const std::size_t index : cell_elements_) {
    const Element& element = elements_[index];
    const auto found = materials_.find(element.property);
    const std::int64_t material = element.material != 0       ? element.material
                                  : found == materials_.end() ? 0
                                                              : found->second;
    any_material = any_material || material != 0;
    properties.values.push_back(static_cast<double>(element.property));
    materials.values.push_back(static_cast<double>(material));
  }
  dataset.add_cell_column(std::move(properties));
  if (any_material) dataset.add_cell_column(std::move(materials));
  if (are_unique(node_ids_)) {
    dataset.add_node_column(to_column(kNodeIdArray, node_ids_));
    content.node_ids = node_ids_;
  }
  if (scopes_.size() == 1) {
    dataset.add_cell_column(to_column(kElementIdArray, content.cell_ids));
  } else {
    content.cell_ids.clear();  // they may repeat
  }
}

void NastranModel::store_groups(const NastranNames& names, FileContent& content,
                                const PlainDataset& dataset) const {
  std::set<std::pair<int, std::int64_t>> known;
  Cell cell;
  for (std::size_t place = 0; place < cell_elements_.size(); ++place) {
    const std::int64_t property = elements_[cell_elements_[place]].property;
    dataset.get_cell(static_cast<std::int64_t>(place), cell);
    const auto dimension = cell_dimension(cell.type, cell.nodes.size());
    if (!dimension || property < 1 || property > std::numeric_limits<int>::max() ||
        !known.emplace(*dimension, property).second) {
      continue;
    }
    const std::string name = names.property_name(property);
    content.groups.push_back({*dimension,
                              name.empty() ? std::to_string(property) : name,
                              kEntityArray,
                              {static_cast<int>(property)}});
  }
}

void NastranModel::store_sets(const NastranNames& names, FileContent& content) const {
  const Scope& scope = scopes_.front();
  std::optional<IdIndex> by_id;
  for (const NastranNames::Set& set : names.sets()) {
    NodeSet found{set.name, {}};
    if (!set.of_elements) {
      for (const std::int64_t id : set.ids.ids_in(scope.index)) {
        found.nodes.push_back(*find_node(scope, id));
      }
    } else {
      std::vector<std::int64_t> ids;
      if (!by_id) {
        for (const Element& element : elements_) ids.push_back(element.scope == 0 ? element.id : 0);
        by_id = IdIndex(ids);
      }
      for (const std::int64_t id : set.ids.ids_in(*by_id)) {
        const std::size_t element = *by_id->find(id);
        for (std::size_t corner = elements_[element].first; corner < end_of(element); ++corner) {
          if (const auto node = find_node(scope, corners_[corner])) found.nodes.push_back(*node);
        }
      }
    }
    content.node_sets.push_back(std::move(found));
  }
}

}  // namespace meshsmooth::formats

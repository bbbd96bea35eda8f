#include "node_sets.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cells.hpp"
#include "content.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

void mark_nodes(const Dataset& dataset, const CellGroup& group, std::vector<std::uint8_t>& marks) {
  const auto column = dataset.cell_column(group.array);
  if (!column) return;
  Cell cell;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    const double value = column->values[static_cast<std::size_t>(id)];
    if (std::ranges::find(group.values, value) == group.values.end()) continue;
    dataset.get_cell(id, cell);
    // Cells that only their format knows are of any dimension.
    const auto dimension = cell_dimension(cell.type, cell.nodes.size());
    if (dimension.value_or(group.dimension) != group.dimension) continue;
    for (const std::int64_t node : cell.nodes) {
      if (static_cast<std::size_t>(node) < marks.size()) marks[static_cast<std::size_t>(node)] = 1;
    }
  }
}

}  // namespace

std::vector<NodeId> find_node_set(const MeshFile& file, const std::string& name) {
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  const FileContent* content = file.content().get();
  std::vector<std::uint8_t> marks(file.mesh.node_count(), 0);
  bool found = false;
  if (content != nullptr) {
    for (const CellGroup& group : content->groups) {
      if (group.name != name) continue;
      found = true;
      mark_nodes(*dataset, group, marks);
    }
    for (const NodeSet& set : content->node_sets) {
      if (set.name != name) continue;
      found = true;
      for (const NodeId node : set.nodes) marks[static_cast<std::size_t>(node)] = 1;
    }
  }
  if (const auto column = dataset->node_column(name)) {
    found = true;
    for (std::size_t node = 0; node < marks.size(); ++node) {
      const double value = column->values[node];
      if (value != 0 && !std::isnan(value)) marks[node] = 1;  // Gmsh's data may leave nodes out
    }
  }
  if (!found) {
    fail_unknown_name("no group, node set or scalar point array is named", name,
                      node_set_names(file));
  }
  std::vector<NodeId> nodes;
  for (std::size_t node = 0; node < marks.size(); ++node) {
    if (marks[node] != 0) nodes.push_back(static_cast<NodeId>(node));
  }
  return nodes;
}

std::vector<std::string> node_set_names(const MeshFile& file) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  };
  if (const FileContent* content = file.content().get()) {
    for (const CellGroup& group : content->groups) add(group.name);
    for (const NodeSet& set : content->node_sets) add(set.name);
  }
  for (const Column& column : dataset_of(file)->node_columns()) {
    if (column.name != kNodeIdArray) add(column.name);
  }
  return names;
}

std::vector<Vec3d> find_node_vectors(const MeshFile& file, const std::string& name) {
  if (auto vectors = dataset_of(file)->node_vectors(name)) return std::move(*vectors);
  throw InvalidOption("NAME_UNKNOWN",
                      "the file has no point array of three numbers a node called '" + name + "'",
                      {{"field", name}});
}

}  // namespace meshsmooth::formats

#include "dataset.hpp"

#include <algorithm>

#include "cells.hpp"

namespace meshsmooth::formats {
namespace {

std::optional<Column> find(const std::vector<Column>& columns, const std::string& name) {
  const auto found = std::ranges::find(columns, name, &Column::name);
  return found == columns.end() ? std::nullopt : std::optional(*found);
}

void add_columns(std::vector<StoredArray>& arrays, const std::string& place,
                 const std::vector<Column>& columns) {
  for (const Column& column : columns) {
    arrays.push_back({place + " " + column.name,
                      column.whole ? "integer" : "float64",
                      {reinterpret_cast<const char*>(column.values.data()),
                       column.values.size() * sizeof(double)}});
  }
}

void add_tables(std::vector<StoredArray>& arrays, const std::string& place,
                std::span<const Table> tables) {
  for (const Table& table : tables) {
    arrays.push_back({place + " " + table.name,
                      "float64 x " + std::to_string(table.components),
                      {reinterpret_cast<const char*>(table.values.data()),
                       table.values.size() * sizeof(double)}});
  }
}

}  // namespace

std::vector<StoredArray> Dataset::stored_arrays() const {
  std::vector<StoredArray> arrays;
  add_columns(arrays, "point array", node_columns());
  add_columns(arrays, "cell array", cell_columns());
  add_tables(arrays, "point array", node_tables());
  add_tables(arrays, "cell array", cell_tables());
  return arrays;
}

PlainDataset::PlainDataset(const Mesh& mesh) : positions_(mesh.positions) {
  for (const ElementBlock& block : mesh.blocks) {
    const CellKind& kind = cell_kind(block.type);
    const auto corners = static_cast<std::size_t>(kind.node_count);
    std::vector<std::int64_t> cell(corners);
    for (std::size_t first = 0; first < block.nodes.size(); first += corners) {
      for (std::size_t corner = 0; corner < corners; ++corner) {
        cell[corner] = block.nodes[first + corner];
      }
      add_cell(kind.vtk_type, cell);
    }
  }
}

void PlainDataset::add_cell(int type, std::span<const std::int64_t> nodes) {
  types_.push_back(type);
  nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  first_.push_back(nodes_.size());
}

int PlainDataset::own_type(std::string_view name, int dimension) {
  const auto known = std::ranges::find(own_types_, name, &OwnType::name);
  const auto place = static_cast<int>(known - own_types_.begin());
  if (known == own_types_.end()) own_types_.push_back({std::string(name), dimension});
  return kFirstOwnCellType + place;
}

int PlainDataset::own_dimension(int type) const {
  return own_types_.at(static_cast<std::size_t>(type - kFirstOwnCellType)).dimension;
}

std::int64_t PlainDataset::node_count() const {
  return std::visit([](const auto& nodes) { return static_cast<std::int64_t>(nodes.size()); },
                    positions_);
}

std::int64_t PlainDataset::cell_count() const { return static_cast<std::int64_t>(types_.size()); }

void PlainDataset::get_cell(std::int64_t id, Cell& cell) const {
  const auto place = static_cast<std::size_t>(id);
  cell.type = types_[place];
  cell.nodes.assign(nodes_.begin() + static_cast<std::ptrdiff_t>(first_[place]),
                    nodes_.begin() + static_cast<std::ptrdiff_t>(first_[place + 1]));
}

std::optional<Column> PlainDataset::node_column(const std::string& name) const {
  return find(node_columns_, name);
}

std::optional<Column> PlainDataset::cell_column(const std::string& name) const {
  return find(cell_columns_, name);
}

std::optional<std::vector<Vec3d>> PlainDataset::node_vectors(const std::string& name) const {
  const auto found = std::ranges::find(node_tables_, name, &Table::name);
  if (found == node_tables_.end() || found->components != 3) return std::nullopt;
  std::vector<Vec3d> vectors;
  vectors.reserve(found->values.size() / 3);
  for (std::size_t at = 0; at + 2 < found->values.size(); at += 3) {
    vectors.push_back({found->values[at], found->values[at + 1], found->values[at + 2]});
  }
  return vectors;
}

std::string PlainDataset::cell_name(int type) const {
  // A file may give any number for a type, also one of these.
  if (type >= kFirstOwnCellType) {
    const auto own = static_cast<std::size_t>(type - kFirstOwnCellType);
    if (own < own_types_.size()) return own_types_[own].name;
  }
  if (type == kPolygonCell) return "polygon";
  if (type == kTriangleStripCell) return "triangle strip";
  if (type == kPolyhedronCell) return "polyhedron";
  return "VTK cell type " + std::to_string(type);
}

}  // namespace meshsmooth::formats

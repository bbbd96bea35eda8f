#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cells.hpp"
#include "dataset.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {

/// Cells as a format gives them.
class CellList {
 public:
  /// `kind` must outlive the list, as those of cells.hpp do. `nodes` in the format's order, counted
  /// from `first_node`; as many as the cell has.
  void add(const CellKind& kind, NodeOrder order, std::span<const std::int64_t> nodes,
           std::int64_t first_node);
  /// A cell that cannot be smoothed: a polygon, a polyhedron, a line of many nodes, an own type.
  void add(int type, std::span<const std::int64_t> nodes, std::int64_t first_node);
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  /// Into the data set, which has its positions. Programs disagree with the formats'
  /// documents, and with one another, on the order of nodes: where most cells of a type are
  /// inverted, all of that type are mirrored. O(cells).
  void store(PlainDataset& dataset) const;

 private:
  struct Entry {
    const CellKind* kind;  // null: none
    int type;              // VTK's number
    std::uint32_t count;   // of nodes
  };
  std::vector<Entry> entries_;
  std::vector<std::int64_t> nodes_;  // in VTK's order, from 0
};

}  // namespace meshsmooth::formats

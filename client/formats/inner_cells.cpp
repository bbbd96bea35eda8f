#include "inner_cells.hpp"

#include <algorithm>
#include <array>

#include "cells.hpp"
#include "content.hpp"

namespace meshsmooth::formats {
namespace {

using Marks = std::vector<std::uint8_t>;

/// The corners of a facet, ascending; those of shorter ones begin by -1.
using Facet = std::array<NodeId, kMaxFacetNodes>;

/// How the elements use a facet that may be inside.
struct Use {
  Facet facet;
  std::int64_t cell;
  int count = 0;
  std::int32_t region = 0;  // of the first element
  bool between = false;     // two regions
};

class InnerCellFinder {
 public:
  explicit InnerCellFinder(const MeshFile& file)
      : mesh_(file.mesh),
        content_(*file.content()),
        dimension_(element_shape(mesh_.blocks.front().type).dimension),
        on_boundary_(mesh_.node_count(), 0),
        near_(mesh_.node_count(), 0),
        inner_(mesh_.node_count(), 0) {
    for (const NodeId node : find_boundary_nodes(MeshTopology(mesh_).view(), true)) {
      on_boundary_[static_cast<std::size_t>(node)] = 1;
    }
  }

  [[nodiscard]] InnerCells find() {
    sort_cells();
    count_uses();
    for (const Use& use : uses_) {
      if (use.count > 1 && !use.between) take(use.cell);
    }
    InnerCells result;
    name_groups(result.names);
    take_sets(result.names);
    Marks movable(mesh_.node_count(), 0);
    for (const ElementBlock& block : mesh_.blocks) {
      for (const NodeId node : block.nodes) movable[static_cast<std::size_t>(node)] = 1;
    }
    for (std::size_t node = 0; node < inner_.size(); ++node) {
      const bool fixed = !mesh_.fixed.empty() && mesh_.fixed[node] != 0;
      if (inner_[node] != 0 && movable[node] != 0 && !fixed) {
        result.nodes.push_back(static_cast<NodeId>(node));
      }
    }
    if (result.nodes.empty()) result.names.clear();
    return result;
  }

 private:
  [[nodiscard]] bool is_on_boundary(std::int64_t node) const {
    return on_boundary_[static_cast<std::size_t>(node)] != 0;
  }

  void take(std::int64_t id) {
    Cell cell;
    content_.dataset->get_cell(id, cell);
    for (const std::int64_t node : cell.nodes) inner_[static_cast<std::size_t>(node)] = 1;
    cells_.push_back(id);
  }

  /// A cell with a node inside is inside; of the others, what may be a facet is looked at.
  void sort_cells() {
    Cell cell;
    for (std::int64_t id = 0; id < content_.dataset->cell_count(); ++id) {
      content_.dataset->get_cell(id, cell);
      const auto dimension = cell_dimension(cell.type, cell.nodes.size());
      if (!dimension || *dimension >= dimension_ || cell.nodes.empty()) continue;
      const bool inside =
          !std::ranges::all_of(cell.nodes, [&](std::int64_t node) { return is_on_boundary(node); });
      if (inside) {
        take(id);
      } else if (*dimension == dimension_ - 1) {
        add_use(id, cell);
      }
    }
    std::ranges::sort(uses_, {}, &Use::facet);
  }

  void add_use(std::int64_t id, const Cell& cell) {
    const CellKind* const kind = find_vtk_cell(cell.type, cell.nodes.size());
    if (kind == nullptr) return;
    const int corners =
        kind->element ? element_shape(*kind->element).node_count : 2;  // those of an edge
    Use use{{-1, -1, -1, -1}, id};
    for (int n = 0; n < corners; ++n) {
      use.facet[static_cast<std::size_t>(n)] =
          static_cast<NodeId>(cell.nodes[static_cast<std::size_t>(n)]);
      near_[static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(n)])] = 1;
    }
    std::ranges::sort(use.facet);
    uses_.push_back(use);
  }

  void count_uses() {
    if (uses_.empty()) return;
    std::size_t element = 0;
    for (const ElementBlock& block : mesh_.blocks) {
      const ElementShape& shape = element_shape(block.type);
      const std::size_t width = element_width(block.type);
      for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
        for (int f = 0; f < shape.facet_count; ++f) {
          count_use(shape.facets[f], &block.nodes[at], element);
        }
      }
    }
  }

  void count_use(const FacetShape& shape, const NodeId* nodes, std::size_t element) {
    Facet facet{-1, -1, -1, -1};
    for (int n = 0; n < shape.node_count; ++n) {
      const NodeId node = nodes[shape.nodes[n]];
      if (near_[static_cast<std::size_t>(node)] == 0) return;
      facet[static_cast<std::size_t>(n)] = node;
    }
    std::ranges::sort(facet);
    const std::int32_t region = mesh_.regions.empty() ? 0 : mesh_.regions[element];
    const auto first = std::ranges::lower_bound(uses_, facet, {}, &Use::facet);
    for (auto use = first; use != uses_.end() && use->facet == facet; ++use) {
      if (use->count++ == 0) use->region = region;
      use->between |= use->region != region;
    }
  }

  /// The groups with a cell inside.
  void name_groups(std::vector<std::string>& names) const {
    Cell cell;
    for (const CellGroup& group : content_.groups) {
      if (group.dimension >= dimension_ || cells_.empty()) continue;
      const auto column = content_.dataset->cell_column(group.array);
      if (!column) continue;
      const bool inside = std::ranges::any_of(cells_, [&](std::int64_t id) {
        const double value = column->values[static_cast<std::size_t>(id)];
        if (std::ranges::find(group.values, value) == group.values.end()) return false;
        content_.dataset->get_cell(id, cell);
        return cell_dimension(cell.type, cell.nodes.size()) == group.dimension;
      });
      if (inside) names.push_back(group.name);
    }
  }

  /// Sides of shells may be the shells themselves.
  void take_sets(std::vector<std::string>& names) {
    if (dimension_ != 3) return;
    for (const NodeSet& set : content_.node_sets) {
      if (!set.faces ||
          std::ranges::all_of(set.nodes, [&](NodeId node) { return is_on_boundary(node); })) {
        continue;
      }
      names.push_back(set.name);
      for (const NodeId node : set.nodes) inner_[static_cast<std::size_t>(node)] = 1;
    }
  }

  const Mesh& mesh_;
  const FileContent& content_;
  int dimension_;
  Marks on_boundary_;  // or between regions
  Marks near_;         // corners of cells that may be facets inside
  Marks inner_;
  std::vector<Use> uses_;            // by their facets
  std::vector<std::int64_t> cells_;  // inside
};

}  // namespace

InnerCells find_inner_cells(const MeshFile& file) {
  if (file.content() == nullptr || file.mesh.blocks.empty()) return {};
  const bool faces = std::ranges::any_of(file.content()->node_sets, &NodeSet::faces);
  if (file.lower_dimensional_cell_count() == 0 && !faces) return {};
  return InnerCellFinder(file).find();
}

}  // namespace meshsmooth::formats

#include "inner_cells.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <set>

#include "cells.hpp"
#include "content.hpp"

namespace meshsmooth::formats {
namespace {

using Marks = std::vector<std::uint8_t>;

/// The corners of a facet, ascending; those of shorter ones begin by -1.
using Facet = std::array<NodeId, kMaxFacetNodes>;

/// A lower-dimensional cell of the file, or a facet of one of its sets.
struct Candidate {
  static constexpr std::size_t kNoSet = std::numeric_limits<std::size_t>::max();
  std::int64_t row;  // among the cells, or the facets of the set
  std::size_t set = kNoSet;
};

/// How the elements use a facet that may be inside.
struct Use {
  Facet facet;
  Candidate candidate;
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
    look_at_cells();
    look_at_sets();
    std::ranges::sort(uses_, {}, &Use::facet);
    count_uses();
    for (const Use& use : uses_) {
      if (use.count > 1 && !use.between) take(use.candidate);
    }
    InnerCells result;
    name_groups(result.names);
    name_sets(result.names);
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

  void take(const Candidate& candidate) {
    if (candidate.set != Candidate::kNoSet) {
      mark(content_.node_sets[candidate.set].facets[static_cast<std::size_t>(candidate.row)].nodes);
      sets_.insert(candidate.set);
      return;
    }
    Cell cell;
    content_.dataset->get_cell(candidate.row, cell);
    mark(cell.nodes);
    cells_.push_back(candidate.row);
  }

  template <class Nodes>
  void mark(const Nodes& nodes) {
    for (const auto node : nodes) inner_[static_cast<std::size_t>(node)] = 1;
  }

  void look_at_cells() {
    Cell cell;
    for (std::int64_t id = 0; id < content_.dataset->cell_count(); ++id) {
      content_.dataset->get_cell(id, cell);
      const auto dimension = cell_dimension(cell.type, cell.nodes.size());
      if (!dimension || *dimension >= dimension_ || cell.nodes.empty()) continue;
      const CellKind* const kind = find_vtk_cell(cell.type, cell.nodes.size());
      const std::size_t corners = kind == nullptr ? 0 : corner_count(*kind);
      look_at(cell.nodes, *dimension, corners, {id});
    }
  }

  void look_at_sets() {
    for (std::size_t set = 0; set < content_.node_sets.size(); ++set) {
      const Facets& facets = content_.node_sets[set].facets;
      for (std::size_t row = 0; row < facets.size(); ++row) {
        const auto [nodes, corners] = facets[row];
        const int dimension = static_cast<int>(std::min<std::size_t>(corners, 3)) - 1;
        if (dimension >= dimension_) continue;
        look_at(nodes, dimension, corners, {static_cast<std::int64_t>(row), set});
      }
    }
  }

  /// With a node inside it is inside; of the others, what may be a facet is looked at.
  /// @param corner_count 0: it cannot be a facet
  template <class Nodes>
  void look_at(const Nodes& nodes, int dimension, std::size_t corner_count,
               const Candidate& candidate) {
    if (!std::ranges::all_of(nodes, [&](auto node) { return is_on_boundary(node); })) {
      take(candidate);
    } else if (dimension == dimension_ - 1 && corner_count > 0 && corner_count <= kMaxFacetNodes) {
      Use use{{-1, -1, -1, -1}, candidate};
      for (std::size_t n = 0; n < corner_count; ++n) {
        use.facet[n] = static_cast<NodeId>(nodes[n]);
        near_[static_cast<std::size_t>(nodes[n])] = 1;
      }
      std::ranges::sort(use.facet);
      uses_.push_back(use);
    }
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

  /// The sets with a facet inside.
  void name_sets(std::vector<std::string>& names) const {
    for (const std::size_t set : sets_) {
      const std::string& name = content_.node_sets[set].name;
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
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
  std::set<std::size_t> sets_;       // with a facet inside
};

}  // namespace

bool names_facets(const MeshFile& file) {
  return file.content() != nullptr &&
         std::ranges::any_of(file.content()->node_sets,
                             [](const NodeSet& set) { return set.facets.size() > 0; });
}

InnerCells find_inner_cells(const MeshFile& file) {
  if (file.content() == nullptr || file.mesh.blocks.empty()) return {};
  if (file.lower_dimensional_cell_count() == 0 && !names_facets(file)) return {};
  return InnerCellFinder(file).find();
}

}  // namespace meshsmooth::formats

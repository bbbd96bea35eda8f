#include <algorithm>
#include <map>
#include <utility>

#include "xdmf/cells.hpp"

namespace meshsmooth::formats {
namespace {

/// The cell's nodes in ascending order, by which it is found again.
std::vector<std::int64_t> key_of(const Dataset& dataset, std::int64_t id) {
  Cell cell;
  dataset.get_cell(id, cell);
  std::ranges::sort(cell.nodes);
  return std::move(cell.nodes);
}

/// The cells of the mesh, to be found by their nodes.
class CellFinder {
 public:
  explicit CellFinder(const Dataset& dataset) {
    for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
      cells_.emplace_back(key_of(dataset, id), id);
    }
    std::ranges::sort(cells_);
  }
  /// -1: there is none.
  [[nodiscard]] std::int64_t find(const std::vector<std::int64_t>& key) const {
    const auto found = std::ranges::lower_bound(cells_, key, {}, &Entry::first);
    return found == cells_.end() || found->first != key ? -1 : found->second;
  }

 private:
  using Entry = std::pair<std::vector<std::int64_t>, std::int64_t>;
  std::vector<Entry> cells_;
};

}  // namespace

void read_xdmf_tags(XdmfData& data, const XmlElement& grid, const PlainDataset& tagged,
                    FileContent& content, PlainDataset& dataset) {
  for (const XmlElement& attribute : grid.children("Attribute")) {
    const XmlElement item = data.item_of(attribute);
    if (attribute.attribute("Center") != "Cell" || !data.is_whole(item)) continue;
    const std::string name = attribute.attribute("Name");
    const std::vector<std::int64_t> values = data.integers(item);
    if (static_cast<std::int64_t>(values.size()) != tagged.cell_count()) {
      data.fail("the attribute \"" + name + "\" has " + std::to_string(values.size()) +
                " numbers for " + std::to_string(tagged.cell_count()) + " cells");
    }
    const CellFinder mesh(dataset);
    std::map<std::int64_t, NodeSet> sets;
    Cell tagged_cell;
    Column column{name, true, std::vector<double>(static_cast<std::size_t>(dataset.cell_count()))};
    bool tags_cells = false;
    for (std::size_t row = 0; row < values.size(); ++row) {
      const std::vector<std::int64_t> key = key_of(tagged, static_cast<std::int64_t>(row));
      NodeSet& set = sets[values[row]];
      for (const std::int64_t node : key) {
        if (node < 0 || node >= dataset.node_count()) {
          data.fail("the grid \"" + name + "\" uses node " + std::to_string(node) +
                    ", there are only " + std::to_string(dataset.node_count()));
        }
        set.nodes.push_back(static_cast<NodeId>(node));
      }
      if (values[row] > 0) {  // dolfin has 0, or the highest number, where nothing is tagged
        tagged.get_cell(static_cast<std::int64_t>(row), tagged_cell);
        set.facets.add(tagged_cell);
      }
      const std::int64_t cell = mesh.find(key);
      if (cell < 0) continue;
      column.values[static_cast<std::size_t>(cell)] = static_cast<double>(values[row]);
      tags_cells = true;
    }
    for (auto& [value, set] : sets) {
      set.name = name + ":" + std::to_string(value);
      content.node_sets.push_back(std::move(set));
    }
    if (tags_cells) dataset.add_cell_column(std::move(column));
  }
}

}  // namespace meshsmooth::formats

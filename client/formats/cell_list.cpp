#include "cell_list.hpp"

#include <array>

#include "cell_sides.hpp"

namespace meshsmooth::formats {
void CellList::add(const CellKind& kind, NodeOrder order, std::span<const std::int64_t> nodes,
                   std::int64_t first_node) {
  // Unsigned, for any number may stand in a file.
  for (const std::int8_t place : places_in(order, kind)) {
    nodes_.push_back(static_cast<std::int64_t>(
        static_cast<std::uint64_t>(nodes[static_cast<std::size_t>(place)]) -
        static_cast<std::uint64_t>(first_node)));
  }
  kinds_.push_back(&kind);
}

void CellList::store(PlainDataset& dataset) const {
  const std::vector<Vec3d> positions = std::visit(
      [](const auto& nodes) {
        std::vector<Vec3d> doubles;
        doubles.reserve(nodes.size());
        for (const auto& node : nodes) doubles.push_back(vec3_cast<double>(node));
        return doubles;
      },
      dataset.positions());
  std::array<std::int64_t, kElementTypeCount> sides{};  // by type
  std::size_t first = 0;
  for (const CellKind* kind : kinds_) {
    const auto count = static_cast<std::size_t>(kind->node_count);
    if (kind->dimension == 3) {
      sides[static_cast<std::size_t>(*kind->element)] +=
          side_of<std::int64_t>(*kind, std::span(nodes_).subspan(first, count), positions);
    }
    first += count;
  }
  first = 0;
  std::vector<std::int64_t> cell;
  for (const CellKind* kind : kinds_) {
    const auto count = static_cast<std::size_t>(kind->node_count);
    const auto nodes = std::span(nodes_).subspan(first, count);
    cell.assign(nodes.begin(), nodes.end());
    if (kind->element && sides[static_cast<std::size_t>(*kind->element)] < 0) {
      mirror(*kind, std::span(cell));
    }
    dataset.add_cell(kind->vtk_type, cell);
    first += count;
  }
}

}  // namespace meshsmooth::formats

#include "cell_list.hpp"

#include <array>

#include "cell_sides.hpp"

namespace meshsmooth::formats {
namespace {

/// Unsigned, for any number may stand in a file.
std::int64_t counted_from_zero(std::int64_t node, std::int64_t first_node) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(node) -
                                   static_cast<std::uint64_t>(first_node));
}

}  // namespace

void CellList::add(const CellKind& kind, NodeOrder order, std::span<const std::int64_t> nodes,
                   std::int64_t first_node) {
  for (const std::int8_t place : places_in(order, kind)) {
    nodes_.push_back(counted_from_zero(nodes[static_cast<std::size_t>(place)], first_node));
  }
  entries_.push_back({&kind, kind.vtk_type, static_cast<std::uint32_t>(kind.node_count)});
}

void CellList::add(int type, std::span<const std::int64_t> nodes, std::int64_t first_node) {
  for (const std::int64_t node : nodes) nodes_.push_back(counted_from_zero(node, first_node));
  entries_.push_back({nullptr, type, static_cast<std::uint32_t>(nodes.size())});
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
  for (const auto& [kind, type, count] : entries_) {
    if (kind != nullptr && kind->dimension == 3) {
      sides[static_cast<std::size_t>(*kind->element)] +=
          side_of<std::int64_t>(*kind, std::span(nodes_).subspan(first, count), positions);
    }
    first += count;
  }
  first = 0;
  std::vector<std::int64_t> cell;
  for (const auto& [kind, type, count] : entries_) {
    const auto nodes = std::span(nodes_).subspan(first, count);
    cell.assign(nodes.begin(), nodes.end());
    if (kind != nullptr && kind->element && sides[static_cast<std::size_t>(*kind->element)] < 0) {
      mirror(*kind, std::span(cell));
    }
    dataset.add_cell(type, cell);
    first += count;
  }
}

}  // namespace meshsmooth::formats

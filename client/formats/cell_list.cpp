#include "cell_list.hpp"

#include <algorithm>
#include <array>

namespace meshsmooth::formats {
namespace {

/// Surfaces and lines have no side to be wrong.
void mirror(const CellKind& kind, std::span<std::int64_t> cell) {
  const auto places = places_in(NodeOrder::mirrored, kind);
  std::array<std::int64_t, kMaxCellNodes> copy{};
  std::ranges::copy(cell, copy.begin());
  for (std::size_t node = 0; node < cell.size(); ++node) {
    cell[node] = copy[static_cast<std::size_t>(places[node])];
  }
}

/// The sign of the volume at the first corner; 0 where nodes do not exist.
int side(const CellKind& kind, std::span<const std::int64_t> cell,
         const std::vector<Vec3d>& positions) {
  const ElementType type = linear_type(*kind.element);
  const bool triangle = type == ElementType::tetrahedron || type == ElementType::wedge;
  const std::array<std::size_t, 4> corners = {0, 1, triangle ? 2U : 3U, triangle ? 3U : 4U};
  std::array<Vec3d, 4> places{};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const auto node = static_cast<std::size_t>(cell[corners[corner]]);
    if (node >= positions.size()) return 0;
    places[corner] = positions[node];
  }
  const Vec3d normal = cross(places[1] - places[0], places[2] - places[0]);
  const double volume = dot(normal, places[3] - places[0]) * (type == ElementType::wedge ? -1 : 1);
  return (volume > 0 ? 1 : 0) - (volume < 0 ? 1 : 0);
}

}  // namespace

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
          side(*kind, std::span(nodes_).subspan(first, count), positions);
    }
    first += count;
  }
  first = 0;
  std::vector<std::int64_t> cell;
  for (const CellKind* kind : kinds_) {
    const auto count = static_cast<std::size_t>(kind->node_count);
    const auto nodes = std::span(nodes_).subspan(first, count);
    cell.assign(nodes.begin(), nodes.end());
    if (kind->element && sides[static_cast<std::size_t>(*kind->element)] < 0) mirror(*kind, cell);
    dataset.add_cell(kind->vtk_type, cell);
    first += count;
  }
}

}  // namespace meshsmooth::formats

#include "cell_list.hpp"

#include <array>

namespace meshsmooth::formats {
namespace {

/// The cell seen in a mirror; surfaces and lines have no side to be wrong.
std::array<std::int8_t, 8> mirrored(int vtk_type) {
  switch (vtk_type) {
    case kTetrahedronCell:
      return {0, 2, 1, 3, 4, 5, 6, 7};
    case kPyramidCell:
      return {0, 3, 2, 1, 4, 5, 6, 7};
    case kWedgeCell:
      return {0, 2, 1, 3, 5, 4, 6, 7};
    case kHexahedronCell:
      return {0, 3, 2, 1, 4, 7, 6, 5};
    default:
      return {0, 1, 2, 3, 4, 5, 6, 7};
  }
}

void mirror(const CellKind& kind, std::span<std::int64_t> cell) {
  const auto order = mirrored(kind.vtk_type);
  std::array<std::int64_t, 8> copy{};
  std::ranges::copy(cell, copy.begin());
  for (std::size_t corner = 0; corner < cell.size(); ++corner) {
    cell[corner] = copy[static_cast<std::size_t>(order[corner])];
  }
}

/// The sign of the volume at the first corner; 0 where nodes do not exist.
int side(const CellKind& kind, std::span<const std::int64_t> cell,
         const std::vector<Vec3d>& positions) {
  const bool triangle = kind.vtk_type == kTetrahedronCell || kind.vtk_type == kWedgeCell;
  const std::array<std::size_t, 4> corners = {0, 1, triangle ? 2U : 3U, triangle ? 3U : 4U};
  std::array<Vec3d, 4> places{};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const auto node = static_cast<std::size_t>(cell[corners[corner]]);
    if (node >= positions.size()) return 0;
    places[corner] = positions[node];
  }
  const Vec3d normal = cross(places[1] - places[0], places[2] - places[0]);
  const double volume = dot(normal, places[3] - places[0]) * (kind.vtk_type == kWedgeCell ? -1 : 1);
  return (volume > 0 ? 1 : 0) - (volume < 0 ? 1 : 0);
}

}  // namespace

void CellList::add(const CellKind& kind, NodeOrder order, std::span<const std::int64_t> nodes,
                   std::int64_t first_node) {
  const std::size_t first = nodes_.size();
  // Unsigned, for any number may stand in a file.
  for (const std::int64_t node : nodes) {
    nodes_.push_back(static_cast<std::int64_t>(static_cast<std::uint64_t>(node) -
                                               static_cast<std::uint64_t>(first_node)));
  }
  const bool wedge = kind.vtk_type == kWedgeCell;
  const bool other = order == NodeOrder::gmsh ? wedge : order == NodeOrder::med && !wedge;
  if (other) mirror(kind, std::span(nodes_).subspan(first));
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
  std::array<std::int64_t, kPyramidCell + 1> sides{};  // by VTK's type
  std::size_t first = 0;
  for (const CellKind* kind : kinds_) {
    const auto corners = static_cast<std::size_t>(kind->node_count);
    if (kind->dimension == 3) {
      sides[static_cast<std::size_t>(kind->vtk_type)] +=
          side(*kind, std::span(nodes_).subspan(first, corners), positions);
    }
    first += corners;
  }
  first = 0;
  std::vector<std::int64_t> cell;
  for (const CellKind* kind : kinds_) {
    const auto corners = static_cast<std::size_t>(kind->node_count);
    const auto nodes = std::span(nodes_).subspan(first, corners);
    cell.assign(nodes.begin(), nodes.end());
    if (sides[static_cast<std::size_t>(kind->vtk_type)] < 0) mirror(*kind, cell);
    dataset.add_cell(kind->vtk_type, cell);
    first += corners;
  }
}

}  // namespace meshsmooth::formats

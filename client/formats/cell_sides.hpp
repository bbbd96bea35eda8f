#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "meshsmooth/vec3.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {

/// The sign of the volume at the first corner of a volume cell; 0 where nodes do not exist.
template <class Id>
[[nodiscard]] int side_of(const CellKind& kind, std::span<const Id> cell,
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

/// Turns a cell over by the order of its nodes. Surfaces and lines have no side to be wrong.
template <class Id>
void mirror(const CellKind& kind, std::span<Id> cell) {
  const auto places = places_in(NodeOrder::mirrored, kind);
  std::array<Id, kMaxCellNodes> copy{};
  std::ranges::copy(cell, copy.begin());
  for (std::size_t node = 0; node < cell.size(); ++node) {
    cell[node] = copy[static_cast<std::size_t>(places[node])];
  }
}

}  // namespace meshsmooth::formats

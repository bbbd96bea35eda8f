#pragma once

#include <array>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/element.hpp"
#include "meshsmooth/vec3.hpp"

namespace meshsmooth::detail {

/// How far apart two nodes of an interface may lie that coincide, by the longest edge of the
/// element: what is left of digits when coordinates are printed.
inline constexpr double kInterfaceThickness = 1e-9;

/// Whether an element has no thickness: two opposite facets coincide node by node. `get(n)` gives
/// the position of corner n in double.
template <class Get>
MESHSMOOTH_HD bool is_interface(const ElementShape& shape, const Get& get) {
  // Pairs of corners in each direction in which an element may have no thickness.
  struct Pairs {
    int count;
    std::int8_t nodes[4][2];
  };
  constexpr Pairs kQuad[] = {{2, {{0, 3}, {1, 2}}}, {2, {{0, 1}, {3, 2}}}};
  constexpr Pairs kWedge[] = {{3, {{0, 3}, {1, 4}, {2, 5}}}};
  constexpr Pairs kHexahedron[] = {{4, {{0, 4}, {1, 5}, {2, 6}, {3, 7}}},
                                   {4, {{0, 1}, {3, 2}, {4, 5}, {7, 6}}},
                                   {4, {{0, 3}, {1, 2}, {4, 7}, {5, 6}}}};
  const bool quad = shape.dimension == 2 && shape.node_count == 4;
  const bool wedge = shape.node_count == 6, hexahedron = shape.node_count == 8;
  if (!quad && !wedge && !hexahedron) return false;
  double longest = 0;
  for (int e = 0; e < shape.edge_count; ++e) {
    const Vec3d edge = get(shape.edges[e][1]) - get(shape.edges[e][0]);
    longest = dot(edge, edge) > longest ? dot(edge, edge) : longest;
  }
  const double nearest = kInterfaceThickness * kInterfaceThickness * longest;
  const Pairs* const ways = quad ? kQuad : wedge ? kWedge : kHexahedron;
  const int way_count = quad ? 2 : wedge ? 1 : 3;
  for (int w = 0; w < way_count; ++w) {
    bool coincide = longest > 0;
    for (int p = 0; p < ways[w].count; ++p) {
      const Vec3d apart = get(ways[w].nodes[p][1]) - get(ways[w].nodes[p][0]);
      coincide = coincide && dot(apart, apart) <= nearest;
    }
    if (coincide) return true;
  }
  return false;
}

}  // namespace meshsmooth::detail

#pragma once

#include <array>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// Six tetrahedra around the diagonal from the first to the seventh corner (Kuhn); corners in
/// VTK's order of a hexahedron. Cells that lie alike in a grid fit.
inline void add_kuhn_tetrahedra(std::vector<NodeId>& tetrahedra,
                                const std::array<NodeId, 8>& corners) {
  constexpr std::array<std::size_t, 7> kRing = {1, 2, 3, 7, 4, 5, 1};
  for (std::size_t n = 0; n < 6; ++n) {
    tetrahedra.insert(tetrahedra.end(),
                      {corners[0], corners[kRing[n]], corners[kRing[n + 1]], corners[6]});
  }
}

/// Three tetrahedra of the prism between a triangle, counter-clockwise seen from above, and the
/// one above it, whose nodes have numbers higher by `up`. Each side is cut from the lower node
/// with the lowest number, so neighbours fit.
inline void add_prism_tetrahedra(std::vector<NodeId>& tetrahedra, std::array<NodeId, 3> base,
                                 NodeId up) {
  // Rotated, so that its orientation stays and the lowest number comes first.
  while (base[0] > base[1] || base[0] > base[2]) base = {base[1], base[2], base[0]};
  const auto [a, b, c] = base;
  tetrahedra.insert(tetrahedra.end(), {a, b + up, c + up, a + up});
  if (b < c) {
    tetrahedra.insert(tetrahedra.end(), {a, b, c, c + up, a, b, c + up, b + up});
  } else {
    tetrahedra.insert(tetrahedra.end(), {a, b, c, b + up, a, c, c + up, b + up});
  }
}

}  // namespace meshsmooth::formats

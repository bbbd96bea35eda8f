// The mesh of the examples: a unit cube of n x n x n hexahedra.
#pragma once

#include <meshsmooth/mesh.hpp>
#include <vector>

inline meshsmooth::Mesh make_grid(int n) {
  const int side = n + 1;
  const auto id = [side](int i, int j, int k) { return (k * side + j) * side + i; };

  std::vector<meshsmooth::Vec3d> positions;
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        positions.push_back({double(i) / n, double(j) / n, double(k) / n});

  // Node order of an element: VTK's, as documented in meshsmooth/element.hpp.
  meshsmooth::ElementBlock hexahedra{meshsmooth::ElementType::hexahedron, {}};
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (const int node :
             {id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k), id(i, j, k + 1),
              id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)})
          hexahedra.nodes.push_back(node);

  meshsmooth::Mesh mesh;
  mesh.positions = std::move(positions);
  mesh.blocks = {std::move(hexahedra)};
  return mesh;
}

#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/cell_grid.hpp"
#include "generate/rotation.hpp"

namespace meshsmooth::formats {

MeshFile generate_bar(const BarOptions& options) {
  check_option("cells", options.cells, 1, 500);
  check_option("degrees", options.degrees, -3600, 3600);
  const int cells = options.cells;
  const CellGrid grid{cells, cells, 4 * cells};
  check_mesh_size(static_cast<double>(grid.node_count()), "cells");

  std::vector<Vec3d> nodes;
  std::vector<std::uint8_t> fixed;
  grid.for_each_node([&](int i, int j, int k) {
    const Vec3d start = {double(i) / cells, double(j) / cells, double(k) / cells};
    const bool on_end = k == 0 || k == grid.z;
    const bool on_side = i == 0 || i == cells || j == 0 || j == cells;
    const bool given = on_end || (on_side && options.sides_given);
    const double share = double(k) / grid.z;
    nodes.push_back(given ? rotated(start, {0.5, 0.5, 0}, share * options.degrees) : start);
    fixed.push_back(given ? 1 : 0);
  });
  Mesh mesh;
  mesh.positions = std::move(nodes);
  mesh.blocks.push_back(grid.kuhn_tetrahedra());
  return make_case_file(std::move(mesh), fixed);
}

}  // namespace meshsmooth::formats

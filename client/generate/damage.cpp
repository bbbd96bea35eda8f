#include <algorithm>
#include <cmath>

#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/cell_grid.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

constexpr double kPush = 0.999;  // of the edge

/// Places that fill the cube evenly however many are taken: the R3 sequence (Roberts 2018).
class EvenSequence {
 public:
  explicit EvenSequence(int cells) : cells_(cells) {}
  /// Indices from 2 to `cells` - 3: the nodes of all touched elements are inside or next to it.
  [[nodiscard]] std::array<int, 3> next() {
    constexpr std::array<double, 3> kSteps = {0.8191725133961645, 0.6710436067037893,
                                              0.5497004779019703};
    std::array<int, 3> indices{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at_[axis] = std::fmod(at_[axis] + kSteps[axis], 1.0);
      indices[axis] = 2 + static_cast<int>(at_[axis] * (cells_ - 4));
    }
    return indices;
  }

 private:
  int cells_;
  std::array<double, 3> at_ = {0.5, 0.5, 0.5};
};

/// Nodes that are at least four edges apart in some direction.
std::vector<NodeId> spread_nodes(const CellGrid& grid, int count) {
  std::vector<NodeId> found;
  std::vector<bool> taken(grid.node_count());
  EvenSequence sequence(grid.x);
  // The n-th node is found after a few n tries while there is room.
  const std::int64_t tries = 1000 + 64 * static_cast<std::int64_t>(count);
  for (std::int64_t n = 0; n < tries && found.size() < static_cast<std::size_t>(count); ++n) {
    const auto [i, j, k] = sequence.next();
    const NodeId node = grid.node(i, j, k);
    if (taken[static_cast<std::size_t>(node)]) continue;
    found.push_back(node);
    for (int z = std::max(0, k - 3); z <= std::min(grid.z, k + 3); ++z) {
      for (int y = std::max(0, j - 3); y <= std::min(grid.y, j + 3); ++y) {
        for (int x = std::max(0, i - 3); x <= std::min(grid.x, i + 3); ++x) {
          taken[static_cast<std::size_t>(grid.node(x, y, z))] = true;
        }
      }
    }
  }
  if (found.size() < static_cast<std::size_t>(count)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "count " + std::to_string(count) + ": only " +
                            std::to_string(found.size()) + " damaged nodes fit into " +
                            std::to_string(grid.x) + " cells along an edge",
                        {{"field", "count"}});
  }
  return found;
}

}  // namespace

MeshFile generate_damage(const DamageOptions& options) {
  check_option("cells", options.cells, 5, 460);
  check_option("count", options.count, 0, 1000000);
  const int cells = options.cells;
  const CellGrid grid{cells, cells, cells};
  std::vector<Vec3d> nodes;
  grid.for_each_node([&](int i, int j, int k) {
    nodes.push_back({double(i) / cells, double(j) / cells, double(k) / cells});
  });
  for (const NodeId node : spread_nodes(grid, options.count)) {
    nodes[static_cast<std::size_t>(node)].x += kPush / cells;
  }
  Mesh mesh;
  mesh.positions = std::move(nodes);
  mesh.blocks.push_back(grid.kuhn_tetrahedra());
  return make_case_file(std::move(mesh), {});
}

}  // namespace meshsmooth::formats

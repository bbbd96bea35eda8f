#pragma once

#include <functional>

#include "support/oracle.hpp"

namespace meshsmooth::test {

/// A mesh of unit cells, some left out, others in regions of their own: which nodes may move
/// along which axis is known from the cells around them.
class Cells {
 public:
  static constexpr int kNone = -1;
  using Region = std::function<int(int x, int y, int z)>;  // of a cell, or kNone

  Cells(ElementType type, int n, const Region& region)
      : n_(n), flat_(oracle::is_surface(type)), region_(region), mesh_(lattice(type, n)) {
    std::vector<NodeId> kept;
    const std::vector<NodeId> all = std::move(mesh_.blocks[0].nodes);
    const auto width = element_width(type);
    for (std::size_t first = 0; first < all.size(); first += width) {
      Vec3d centre{0, 0, 0};
      for (std::size_t k = 0; k < width; ++k) centre += points(mesh_)[all[first + k]];
      centre = (1.0 / static_cast<double>(width)) * centre;
      const int found = region_of(static_cast<int>(centre.x), static_cast<int>(centre.y),
                                  static_cast<int>(centre.z));
      if (found == kNone) continue;
      mesh_.regions.push_back(found);
      kept.insert(kept.end(), &all[first], &all[first] + width);
    }
    mesh_.blocks[0].nodes = std::move(kept);
    grid_ = points(mesh_);
  }

  /// The regular mesh; of nodes in no cell nothing is known.
  [[nodiscard]] const Mesh& mesh() const { return mesh_; }

  /// Whether the mesh looks the same from a node's neighbours along the axis.
  [[nodiscard]] bool may_move(std::size_t node, int axis) const {
    if (flat_ && axis == 2) return false;
    const int at[3] = {static_cast<int>(std::floor(grid_[node].x)),
                       static_cast<int>(std::floor(grid_[node].y)),
                       static_cast<int>(std::floor(grid_[node].z))};
    if (grid_[node].x != at[0]) return true;  // the middle of a cell
    for (int corner = 0; corner < 8; ++corner) {
      if ((corner >> axis & 1) != 0) continue;
      int cell[3];
      for (int a = 0; a < 3; ++a) cell[a] = at[a] - 1 + (corner >> a & 1);
      if (flat_) cell[2] = 0;
      const int before = region_of(cell[0], cell[1], cell[2]);
      ++cell[axis];
      if (region_of(cell[0], cell[1], cell[2]) != before) return false;
    }
    return true;
  }
  [[nodiscard]] int node_constraints(std::size_t node) const {
    return int{may_move(node, 0)} + int{may_move(node, 1)} + int{may_move(node, 2)};
  }

  /// Where the node is before anything is thrown or mapped.
  [[nodiscard]] Vec3d grid(std::size_t node) const { return grid_[node]; }

  [[nodiscard]] std::vector<bool> used() const {
    std::vector<bool> used(mesh_.node_count());
    for (const NodeId n : mesh_.blocks[0].nodes) used[n] = true;
    return used;
  }

  /// Every node thrown about along the axes on which it may move.
  [[nodiscard]] Mesh thrown(double size, unsigned seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> noise(-size, size);
    Mesh mesh = mesh_;
    for (std::size_t n = 0; n < grid_.size(); ++n) {
      const Vec3d move{noise(random), noise(random), noise(random)};
      if (may_move(n, 0)) points(mesh)[n].x += move.x;
      if (may_move(n, 1)) points(mesh)[n].y += move.y;
      if (may_move(n, 2)) points(mesh)[n].z += move.z;
    }
    return mesh;
  }

 private:
  [[nodiscard]] int region_of(int x, int y, int z) const {
    const auto inside = [this](int c) { return c >= 0 && c < n_; };
    return inside(x) && inside(y) && (flat_ || inside(z)) ? region_(x, y, z) : kNone;
  }

  int n_;
  bool flat_;
  Region region_;
  Mesh mesh_;
  std::vector<Vec3d> grid_;
};

/// One block, a step with an edge that goes inwards, a hole, two regions, four around a line.
inline std::vector<std::pair<std::string, Cells::Region>> shapes(int n) {
  const int half = n / 2;
  return {
      {"cube", [](int, int, int) { return 0; }},
      {"step", [=](int x, int, int z) { return x >= half && z >= half ? Cells::kNone : 0; }},
      {"notch", [=](int x, int y, int z) { return x >= half && y >= half && z >= half ? -1 : 0; }},
      {"two_regions", [=](int x, int, int) { return x < half ? 7 : 3; }},
      {"part_in_part",
       [=](int x, int y, int z) { return x >= half && y >= half && z >= half ? 1 : 2; }},
      {"four_regions", [=](int x, int y, int) { return (x < half ? 0 : 1) + (y < half ? 0 : 5); }}};
}

/// Nodes with as many node_constraints that have moved.
inline int moved(const Cells& cells, int node_constraints, const Mesh& before, const Mesh& after) {
  const std::vector<Vec3d> x = points_as_double(before), y = points_as_double(after);
  int count = 0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    if (cells.node_constraints(n) == node_constraints && !(x[n] == y[n])) ++count;
  }
  return count;
}

}  // namespace meshsmooth::test

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "surface/boundary_mesh.hpp"
#include "surface/checkpoint.hpp"

namespace meshsmooth::detail {

/// A node and how unlikely it is to be at a feature of a surface.
struct Match {
  double mismatch;
  std::int32_t node;

  friend auto operator<=>(const Match&, const Match&) = default;
};

/// Finds the boundary's nodes that are likeliest to be at a feature of a surface: by their
/// distance, in edge lengths, less where the boundary has creases of its own. A tree of boxes.
class NodeTree {
 public:
  /// O(nodes log nodes).
  NodeTree(const BoundaryMesh& boundary, const std::function<void()>& check);

  /// @param corner  whether more or fewer than two curves meet there
  /// @param is_free which nodes count
  /// @returns at most `count` of them, the likeliest first; of equals the lowest. O(log nodes) for
  ///          few; a search ends after `kMostBoxes`
  [[nodiscard]] std::vector<Match> likeliest(
      Vec3d at, bool corner, std::size_t count,
      const std::function<bool(std::int32_t)>& is_free) const;

 private:
  static constexpr std::size_t kLeaf = 8;          // nodes
  static constexpr std::size_t kMostBoxes = 1000;  // that a search visits

  struct Box {
    std::array<double, 3> lower, upper;
    double largest_size;
    std::size_t first, last;  // of the order
    std::size_t right;        // the left child is the next one; 0: a leaf
  };

  void add_boxes(std::size_t first, std::size_t last, Checkpoint& checkpoint);
  /// At most the mismatch of any node in it.
  [[nodiscard]] double bound(const Box& box, Vec3d at) const;
  [[nodiscard]] double mismatch(std::int32_t n, Vec3d at, bool corner) const;

  const BoundaryMesh& boundary_;
  std::vector<int> creases_;         // by node: how many end there
  std::vector<std::int32_t> order_;  // nodes
  std::vector<Box> boxes_;
};

}  // namespace meshsmooth::detail

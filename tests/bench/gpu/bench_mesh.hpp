#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::bench {

/// A mesh of tetrahedra to measure on.
struct BenchMesh {
  std::string name;  // "100k"
  std::vector<Vec3d> positions;
  std::vector<NodeId> tetrahedra;  // 4 nodes each

  [[nodiscard]] std::size_t node_count() const { return positions.size(); }
  [[nodiscard]] std::size_t tetrahedron_count() const { return tetrahedra.size() / 4; }
  /// As the paper has them.
  [[nodiscard]] std::vector<Vec3f> float_positions() const;
};

/// The paper's cube and slope as `meshsmooth generate` makes them, seed 1. With
/// a directory `cache` they are kept there: a million nodes take TetGen half a
/// minute.
[[nodiscard]] BenchMesh make_cube(std::size_t node_count, const std::filesystem::path& cache);
[[nodiscard]] BenchMesh make_slope(std::size_t node_count, const std::filesystem::path& cache);

enum class NodeOrder { natural, permuted };

/// side³ nodes of a regular grid in the unit cube, the interior ones jittered,
/// six tetrahedra to a cell. `permuted`: node ids shuffled, tetrahedra in their
/// natural order.
[[nodiscard]] BenchMesh make_grid(int side, NodeOrder order);

/// "5k", "100k", "1M" of a round number, else the number.
[[nodiscard]] std::string short_count(std::size_t count);

}  // namespace meshsmooth::bench

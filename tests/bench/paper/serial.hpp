#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"

/// The serial algorithm of Xiao et al. 2019 on one core: the slow and obvious
/// version with which the others are compared.
namespace meshsmooth::bench {

/// Rings: the neighbours of node n are entries[starts[n]] … entries[starts[n + 1]],
/// in ascending order.
struct Rings {
  std::vector<std::int32_t> starts;
  std::vector<NodeId> entries;

  [[nodiscard]] std::span<const NodeId> of(std::size_t node) const {
    return std::span(entries).subspan(static_cast<std::size_t>(starts[node]),
                                      static_cast<std::size_t>(starts[node + 1] - starts[node]));
  }
  [[nodiscard]] std::size_t node_count() const { return starts.size() - 1; }
};

/// Every corner of a tetrahedron is noted at the other three, unless it is there
/// already. O(tetrahedra * degree).
[[nodiscard]] Rings find_neighbours_serial(std::size_t node_count,
                                           std::span<const NodeId> tetrahedra);

/// One byte a node, 1 on the boundary: the nodes of the faces that occur once
/// among all sorted faces. O(n log n).
[[nodiscard]] std::vector<std::uint8_t> find_boundary_serial(std::size_t node_count,
                                                             std::span<const NodeId> tetrahedra);

struct SerialResult {
  std::vector<Vec3f> positions;
  int sweep_count = 0;
};

/// Sweeps until no node moves farther than `tolerance`, or `most_sweeps`. Form A
/// reads one array and writes another.
[[nodiscard]] SerialResult smooth_form_a(const Rings& rings,
                                         const std::vector<std::uint8_t>& boundary,
                                         std::vector<Vec3f> positions, float tolerance,
                                         int most_sweeps);
/// Form B moves the nodes in place, in the order of their ids.
[[nodiscard]] SerialResult smooth_form_b(const Rings& rings,
                                         const std::vector<std::uint8_t>& boundary,
                                         std::vector<Vec3f> positions, float tolerance,
                                         int most_sweeps);

/// How far the next sweep of form A would move a node at most: what the
/// tolerance is about.
[[nodiscard]] double largest_move(const Rings& rings, const std::vector<std::uint8_t>& boundary,
                                  std::span<const Vec3f> positions);

/// The largest distance between nodes of the same id.
[[nodiscard]] double largest_difference(std::span<const Vec3f> a, std::span<const Vec3f> b);

}  // namespace meshsmooth::bench

#pragma once

// A mesh as the kernels take it, as plain arrays: what a test hands to a step.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::test {

/// The position as float32 stores it. The array keeps g++ 12 at -O3 from dropping the rounding of
/// the coordinates that it converts in pairs.
[[nodiscard]] inline Vec3d rounded_to_float32(const Vec3d& position) {
  volatile float stored[3] = {static_cast<float>(position.x), static_cast<float>(position.y),
                              static_cast<float>(position.z)};
  return {stored[0], stored[1], stored[2]};
}

/// A mesh in internal numbers with its topology, made by the oracle (`flatten`): no step of the
/// product has had a hand in it, so a test of one step does not depend on the others. Internal
/// node numbers run backwards through the caller's.
struct FlatMesh {
  struct Run {
    ElementType type;
    std::vector<NodeId> nodes;
  };

  int dimension = 3;
  std::vector<NodeId> caller_ids;  // of nodes
  std::vector<Vec3d> positions;
  std::vector<std::uint8_t> fixed;
  std::vector<Run> runs;  // in the order of the element table
  std::vector<std::uint32_t> element_caller_ids;
  std::vector<std::int64_t> ring_offsets, ball_offsets;
  std::vector<NodeId> ring_entries;  // a row ascends by the callers' ids
  std::vector<std::uint32_t> ball_entries;
  std::vector<NodeId> colour_nodes;  // colour after colour
  std::vector<std::size_t> colour_first;
  std::vector<PackedDirection> references;  // of surface elements; empty: all have `reference`
  Vec3d reference{0, 0, 0};
  double diagonal = 1;  // of the bounding box

  [[nodiscard]] std::size_t node_count() const { return caller_ids.size(); }
  [[nodiscard]] std::size_t free_count() const {
    return static_cast<std::size_t>(std::count(fixed.begin(), fixed.end(), std::uint8_t{0}));
  }
  /// Values of the nodes in the caller's order.
  template <class T>
  [[nodiscard]] std::vector<T> in_callers_order(const std::vector<T>& values) const {
    std::vector<T> result(values.size());
    for (std::size_t n = 0; n < values.size(); ++n) {
      result[static_cast<std::size_t>(caller_ids[n])] = values[n];
    }
    return result;
  }
};

}  // namespace meshsmooth::test

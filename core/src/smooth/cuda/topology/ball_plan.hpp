#pragma once

#include "smooth/steps/form.hpp"
#include "smooth/steps/mesh_counts.hpp"

namespace meshsmooth::detail {

/// How the balls of a job are found.
struct BallPlan {
  bool slotted;  // in slots first, a fixed number for each node: large, but filled while the
                 // elements are still on their way
  bool kept;     // in rows, beyond the search for rings

  static constexpr std::int64_t kSlots = 64;  // more elements than most nodes have

  static BallPlan of(const MeshSize& size, const SmoothOptions& options) {
    constexpr std::int64_t kMostNodes = 1 << 17;  // where room is no matter
    const auto tetrahedra = size.element_counts[static_cast<std::size_t>(ElementType::tetrahedron)];
    return {size.node_count <= kMostNodes && tetrahedra == count_mesh(size).elements,
            needs_balls(options) || size.regions};
  }
};

}  // namespace meshsmooth::detail

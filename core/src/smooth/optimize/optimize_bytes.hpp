#pragma once

#include <algorithm>

#include "smooth/base/mesh_counts.hpp"
#include "smooth/guard/limit_moves.hpp"
#include "smooth/guard/sweep_context.hpp"
#include "smooth/optimize/anderson.hpp"

namespace meshsmooth::detail {

/// Sweeps of untangling, and of the descent, after which an error counts as long.
inline constexpr int kUntanglingSweeps = 10;
inline constexpr int kDescentSweeps = 15;
/// The same of the descent where global steps follow, which cost less.
inline constexpr int kSweepsBeforeSteps = 7;

/// Bytes of `Optimizer` besides its parts: states and opposite nodes.
[[nodiscard]] inline std::int64_t optimizer_bytes(const MeshCounts& mesh) {
  return mesh.nodes + (mesh.only(4) ? 3 * 4 * mesh.entries : 0);
}

/// Bytes of `optimize`: states, opposite nodes, and the most of its parts. Each part but the last
/// of repair holds what a backend's sweeps need, `sweeping`, and most of them where to return to.
[[nodiscard]] inline std::int64_t optimize_bytes(const MeshCounts& mesh, const JobPlan& plan,
                                                 std::int64_t sweeping) {
  const std::int64_t positions = mesh.nodes * mesh.position_bytes;
  const bool returns =
      plan.options.report_below || (plan.optimizer && plan.optimizer->goal == Goal::worst);
  std::int64_t most = returns ? positions + sweeping : sweeping;
  if (plan.tangled == TangledPolicy::repair) {
    const bool softens = plan.iteration_limit > kUntanglingSweeps;
    most = std::max(
        most, positions + std::max(softens ? sweeping : 0, limit_moves_bytes(mesh.nodes, false)));
  }
  if (plan.iteration_limit > kDescentSweeps) {
    most = std::max(most, positions + anderson_bytes(mesh) + sweeping);
  }
  return optimizer_bytes(mesh) + most + (plan.raises_jacobians ? positions : 0);
}

}  // namespace meshsmooth::detail

#pragma once

#include <oneapi/tbb/task_arena.h>

#include <functional>
#include <span>
#include <vector>

#include "meshsmooth/smoother.hpp"
#include "smooth/second_order/corner_mesh.hpp"

namespace meshsmooth::detail {

/// Smooths the mesh of the corners in place; `held` are further nodes of it that stay, or empty.
template <class Real>
using SmoothCorners =
    std::function<SmoothSummary(std::vector<Vec3<Real>>& corners, const SmoothOptions& options,
                                const std::vector<NodeId>& held)>;

/// A job on a mesh of second order: its corners by `run`, the other nodes by `Carry`, invalid and
/// distorted elements by `cure`, these two on the threads of the arena. `mesh` is of `topology`;
/// `given` are the nodes' positions at first, checked like the arrays of the options, and may be
/// `result`, which changes only when it returns.
template <class Real>
SmoothSummary smooth_second_order(tbb::task_arena& arena, const TopologyView& topology,
                                  const CornerMesh& mesh, std::span<const Vec3<Real>> given,
                                  std::span<Vec3<Real>> result, const SmoothOptions& options,
                                  const JobControl& control, const SmoothCorners<Real>& run);

}  // namespace meshsmooth::detail

#pragma once

#include <oneapi/tbb/task_arena.h>

#include <functional>
#include <vector>

#include "meshsmooth/smoother.hpp"
#include "smooth/base/job_arrays.hpp"
#include "smooth/plan/job_plan.hpp"
#include "smooth/second_order/corner_mesh.hpp"

namespace meshsmooth::detail {

/// Smooths the mesh of the corners in place; `held` are further nodes of it that stay, or empty.
template <class Real>
using SmoothCorners =
    std::function<SmoothSummary(std::vector<Vec3<Real>>& corners, const JobInput& input,
                                const SmoothOptions& options, const std::vector<NodeId>& held)>;

/// What a job on a mesh of second order works with.
template <class Real>
struct SecondOrderTask {
  tbb::task_arena& arena;
  const TopologyView& topology;
  const CornerMesh& mesh;  // of the topology
  const JobPlan& plan;
  const JobControl& control;
  const SmoothCorners<Real>& run;
};

/// A job on a mesh of second order: its corners by `run`, the other nodes by `MidNodes`, invalid
/// and distorted elements by `repair_curved`, these two on the threads of the arena. The arrays are
/// checked; that of the result changes only when it returns.
template <class Real>
SmoothSummary smooth_second_order(const SecondOrderTask<Real>& task, const JobArrays<Real>& arrays);

}  // namespace meshsmooth::detail

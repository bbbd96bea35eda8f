#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "smooth/plan/job_plan.hpp"
#include "smooth/second_order/second_order_job.hpp"

namespace meshsmooth::detail {

/// Whether a job without sweeps counts the poor elements that another one has left. Not of a
/// motion, nor where what holds nodes depends on where they were at first.
[[nodiscard]] inline bool can_count_poor(const JobPlan& plan) {
  const SmoothOptions& options = plan.options;
  return options.report_below && plan.optimizer && !plan.moves && plan.anchor_weight == 0 &&
         !options.only_below && !options.movement_limit;
}

/// The job of the mesh of the corners.
struct CornerJob {
  JobInput input;
  SmoothOptions options;
  const std::vector<NodeId>& held;
};

/// What holds poor elements of the mesh of the corners at `corners`, by a job without sweeps.
///
/// @param first  the positions of the corners before the job, at which `Target::input` aims
template <class Real>
void count_poor(const SmoothCorners<Real>& run, CornerJob job, std::span<const Vec3<Real>> first,
                std::vector<Vec3<Real>> corners, SmoothSummary& summary) {
  SmoothOptions& options = job.options;
  options.max_iterations = 0;
  options.tangled = TangledPolicy::repair;
  auto& method = std::get<Optimize>(options.method);
  if (method.target == Target::input) {
    method.target = Target::reference;
    job.input.reference = first;
  }
  const SmoothSummary counted = run(corners, job.input, options, job.held);
  summary.poor = counted.poor;
  summary.host_peak_bytes = std::max(summary.host_peak_bytes, counted.host_peak_bytes);
}

}  // namespace meshsmooth::detail

#pragma once

#include <string>
#include <vector>

#include "gpu/bench_mesh.hpp"

namespace meshsmooth::bench {

struct LaneFigures {
  int lane_count = 0;
  int job_count = 0;  // of all lanes
  double jobs_per_second = 0;
  int different_count = 0;  // jobs whose bits differ from the single lane's
};

/// Threads with a smoother each, all smoothing the same mesh as fast as they can.
[[nodiscard]] std::vector<LaneFigures> measure_lanes(const BenchMesh& mesh, double tolerance,
                                                     const std::vector<int>& lane_counts);

}  // namespace meshsmooth::bench

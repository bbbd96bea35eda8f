#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include "gpu/bench_mesh.hpp"
#include "gpu/product.hpp"

namespace meshsmooth::bench {

/// `Optimize`, balanced, for so many sweeps.
struct OptimizeRun {
  ProductFigures figures;
  double sweeps_ms = 0;  // of iterate: without colouring and what else comes before
  std::int64_t inverted_before = 0;
  double mean_ratio = 0;  // afterwards
  double worst_ratio = 0;
};

/// What `Optimize` does to a mesh, and to the same tangled.
struct OptimizeFigures {
  double converged_mean = 0;  // mean ratio after many sweeps
  OptimizeRun to_converged;   // until the mean is within 0.1 % of that
  OptimizeRun to_untangled;   // from 40 % inverted elements to none
  /// The largest difference of a quality figure of the backends, of the valid mesh. While a
  /// mesh is tangled roundings grow, until both reach the same optimum.
  std::optional<double> cpu_difference;
};

/// `mesh` is a cube in [0, 1]^3 with a fixed boundary. Throws `std::runtime_error` when a
/// run misses its goal.
[[nodiscard]] OptimizeFigures measure_optimize(const BenchMesh& mesh, int repeats);

[[nodiscard]] Json to_json(const OptimizeFigures& figures);

}  // namespace meshsmooth::bench

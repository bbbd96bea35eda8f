#pragma once

// The jobs that tests run on prepared topologies, of every backend.

#include <vector>

#include "meshsmooth/options.hpp"

namespace meshsmooth::test {

/// Four sweeps by each step that reads what was prepared.
inline std::vector<SmoothOptions> prepared_ways() {
  std::vector<SmoothOptions> ways;
  const auto add = [&](const Method& method, const auto& change) {
    SmoothOptions options;
    options.method = method;
    options.max_iterations = 4;
    options.tolerance = {.value = 0, .relative = false};
    change(options);
    ways.push_back(options);
  };
  const auto as_is = [](SmoothOptions&) {};
  add(Laplacian{}, as_is);
  add(Laplacian{}, [](SmoothOptions& o) { o.guard = false; });
  add(Laplacian{.weighting = Weighting::ball_volume}, as_is);
  add(SmartLaplacian{}, as_is);
  add(Taubin{}, as_is);
  add(HcLaplacian{}, as_is);
  add(Optimize{}, as_is);
  add(SmartLaplacian{}, [](SmoothOptions& o) { o.boundary = BoundaryPolicy::slide; });
  add(SmartLaplacian{}, [](SmoothOptions& o) { o.boundary = BoundaryPolicy::free; });
  return ways;
}

}  // namespace meshsmooth::test

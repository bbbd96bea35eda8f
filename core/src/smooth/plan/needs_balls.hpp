#pragma once

#include "smooth/averaging/means.hpp"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::detail {

/// Whether a job needs the balls beyond finding rings and boundary.
[[nodiscard]] inline bool needs_balls(const SmoothOptions& options) {
  return acceptance_of(options).active() || resolve_form(options) == Form::gauss_seidel ||
         mean_properties(options.method).reads_balls;
}

}  // namespace meshsmooth::detail

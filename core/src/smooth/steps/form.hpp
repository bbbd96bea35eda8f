#pragma once

#include "meshsmooth/options.hpp"
#include "smooth/rules/acceptance.hpp"
#include "smooth/rules/means.hpp"

namespace meshsmooth::detail {

[[nodiscard]] inline Form resolve_form(const SmoothOptions& options) {
  if (options.form != Form::automatic) return options.form;
  return forms_of(options.method).front();
}

[[nodiscard]] inline Acceptance acceptance_of(const SmoothOptions& options) {
  return {options.guard, std::holds_alternative<SmartLaplacian>(options.method),
          options.boundary == BoundaryPolicy::slide};
}

/// Whether a job needs the balls beyond finding rings and boundary.
[[nodiscard]] inline bool needs_balls(const SmoothOptions& options) {
  return acceptance_of(options).active() || resolve_form(options) == Form::gauss_seidel ||
         mean_properties(options.method).reads_balls;
}

}  // namespace meshsmooth::detail

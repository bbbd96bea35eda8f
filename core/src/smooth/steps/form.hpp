#pragma once

#include "meshsmooth/options.hpp"
#include "smooth/rules/acceptance.hpp"

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
  const auto* laplacian = std::get_if<Laplacian>(&options.method);
  return acceptance_of(options).active() || resolve_form(options) == Form::gauss_seidel ||
         (laplacian != nullptr && laplacian->weighting == Weighting::ball_volume);
}

}  // namespace meshsmooth::detail

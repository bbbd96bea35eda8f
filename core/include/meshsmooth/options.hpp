#pragma once

#include <chrono>
#include <optional>

#include "meshsmooth/form.hpp"
#include "meshsmooth/method_traits.hpp"
#include "meshsmooth/methods.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {

/// What nodes of the boundary, and between regions, may do.
enum class BoundaryPolicy {
  fixed,  // they stay
  free,   // they move like all others
  slide,  // in their plane or on their curved part, along their crease; corners stay
};

enum class TangledPolicy { repair, refuse };

/// When a method has converged. In the mesh's unit it is a length, and no node has moved
/// farther in the last sweep. Relative it is a share: of the bounding box's diagonal, for
/// that move; for `Optimize` the share by which a sweep lowers the p-norm of a ball's
/// inverse mean ratios, in the mean over the free nodes.
struct Tolerance {
  double value = 1e-4;
  bool relative = true;
};

/// No node ends farther than this from where it began, to the rounding of the
/// coordinates. Above 0; in the mesh's unit or, relative, as a share of the
/// bounding box's diagonal.
struct MovementLimit {
  double value = 0;
  bool relative = false;
};

struct SmoothOptions {
  Method method = Optimize{};
  Form form = Form::automatic;
  /// >= 0; 0 only evaluates the mesh. Unset: the method's own (`iteration_limit`).
  std::optional<int> max_iterations = {};
  Tolerance tolerance = {};
  BoundaryPolicy boundary = BoundaryPolicy::fixed;
  /// With BoundaryPolicy::slide: planes that meet at less than this are one curved part, and
  /// creases that turn by less one curved crease. Degrees, from 1 to 90.
  double feature_angle = 30;
  bool guard = true;  // a valid element stays valid
  TangledPolicy tangled = TangledPolicy::repair;
  std::optional<std::chrono::nanoseconds> compute_budget = {};
  std::optional<MovementLimit> movement_limit = {};
  bool history = false;
  QualityDetail quality_detail = QualityDetail::full;
};

/// `max_iterations`, or the method's own limit.
[[nodiscard]] inline int iteration_limit(const SmoothOptions& options) {
  return options.max_iterations.value_or(default_iterations(options.method));
}

/// Whether `tolerance` is a share of the energy, not a length.
[[nodiscard]] inline bool converges_by_energy(const SmoothOptions& options) {
  return options.tolerance.relative && std::holds_alternative<Optimize>(options.method);
}

/// A `Tolerance` or a `MovementLimit` in the mesh's unit.
template <class Length>
[[nodiscard]] double in_mesh_unit(const Length& length, double bounding_box_diagonal) {
  return length.value * (length.relative ? bounding_box_diagonal : 1.0);
}

/// The largest move below which a method has converged, in the mesh's unit; 0 where `Optimize` goes
/// by its energy.
[[nodiscard]] inline double displacement_tolerance(const SmoothOptions& options,
                                                   double bounding_box_diagonal) {
  if (converges_by_energy(options)) return 0;
  return in_mesh_unit(options.tolerance, bounding_box_diagonal);
}

/// Throws `InvalidOption` (OPTION_OUT_OF_RANGE, detail "field") or
/// `NotSupported` (OPTION_NOT_SUPPORTED).
void validate(const SmoothOptions& options);

}  // namespace meshsmooth

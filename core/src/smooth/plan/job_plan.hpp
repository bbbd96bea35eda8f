#pragma once

#include <optional>

#include "meshsmooth/annotations.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::detail {

/// Which moves are accepted, evaluated in double on the positions as they are stored.
struct Acceptance {
  bool guard = false;   // a valid element stays valid
  bool smart = false;   // the worst quality of the ball does not fall
  bool facets = false;  // the facets around sliding nodes keep their orientation

  [[nodiscard]] MESHSMOOTH_HD bool active() const { return guard || smart || facets; }
};

/// What the elements of `Optimize` aim at.
enum class Aim {
  ideal,  // the ideal shape of their type
  boxes,  // simplices at that, other elements at boxes from their input
  input,  // their shape in the input
  reference,
};

/// What a job does: decided once, by its options alone. The pipeline and the estimates of memory
/// follow it, so that neither asks the method again.
struct JobPlan {
  SmoothOptions options;  // as the caller chose them

  Form form = Form::jacobi;  // never automatic
  Acceptance acceptance = {};
  int iteration_limit = 0;
  TangledPolicy tangled = TangledPolicy::repair;

  bool averages = false;                     // sweeps move each node towards a mean
  bool uniform_mean = false;                 // all neighbours weigh alike
  bool filters = false;                      // the iterations are the terms of a filter
  bool moves = false;                        // to prescribed positions
  Derivative derivative = Derivative::none;  // in place of that
  int further_positions = 0;  // arrays of them that an iteration of several steps needs
  std::optional<Optimize> optimizer = {};  // of sweeps that optimize; of motions, too
  bool raises_jacobians = false;  // `Optimize` ends with sweeps for the least scaled Jacobian
  Aim aim = Aim::ideal;
  double anchor_weight = 0;  // holds nodes at their input positions; 0: not

  bool stays_on_surface = false;  // nodes of a curved surface mesh
  bool needs_balls = false;       // beyond finding rings and boundary
  bool colours = false;           // sweeps in place, in a fixed order
  bool keeps_quality = false;     // ends with the step `keep_quality`: never worse
  bool keeps_mean = true;         // that step keeps the mean, too
  bool recounts_poor = false;     // after that step, for which the rings are kept
  QualityDetail evaluated_detail = QualityDetail::full;

  [[nodiscard]] bool has_reference() const { return aim == Aim::input || aim == Aim::reference; }
  /// Whether an iteration has several steps, each of the whole mesh.
  [[nodiscard]] bool in_steps() const { return further_positions > 0; }
  /// Whether sweeps optimize a mesh that stays where it is.
  [[nodiscard]] bool improves() const { return optimizer && !moves && iteration_limit > 0; }
};

[[nodiscard]] JobPlan plan_job(const SmoothOptions& options);

}  // namespace meshsmooth::detail

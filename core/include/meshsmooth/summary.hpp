#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshsmooth/enums.hpp"
#include "meshsmooth/quality.hpp"
#include "meshsmooth/target_surface.hpp"

namespace meshsmooth {

/// How the sweeps converged. Lengths are in the mesh's unit.
struct Convergence {
  int iteration_count = 0;
  EndRule end_rule = EndRule::none;
  /// Of `Optimize`: by which share the energy of a free node's ball, to the power of 1/p, would
  /// fall in the mean if the sweeps went on; estimated from the last two. Unset while it does not
  /// converge, and with other methods.
  std::optional<double> remaining_gain;
  double last_max_displacement = 0;
  double last_rms_displacement = 0;
  double tolerance = 0;  ///< See `displacement_tolerance`.
  double bounding_box_diagonal = 0;
  std::int64_t held_node_count = 0;       ///< Moves rejected or shortened in the last sweep.
  std::vector<double> max_displacements;  ///< One per sweep, with SmoothOptions::history.
  std::vector<double> rms_displacements;
  std::vector<std::int64_t> moved_node_counts;
  /// With SmoothOptions::history: after each sweep the p-mean of the inverse mean ratios of all
  /// corners that can change, weighted as by Optimize, at least 1; infinite while the mesh is
  /// tangled. p is that of Goal::balanced, 2; of Optimize that of the sweep's phase
  /// (Goal::average has 1, Goal::worst 2, 4, 8, 16, 32, Move 2 and 8, untangling 1).
  std::vector<double> energies;
  std::vector<double> worst_mean_ratios;  ///< Of those corners; 0 or less while tangled.
};

/// Nodes by what the job did with them.
struct NodeCounts {
  std::int64_t total = 0;
  std::int64_t boundary = 0;  ///< Without those on non-manifold edges.
  std::int64_t fixed = 0;  ///< Boundary, on non-manifold edges, between regions, the caller's own.
  std::int64_t isolated = 0;  ///< In no element; they stay.
  std::int64_t moved = 0;     ///< The position differs from the input.
  std::int64_t between_regions = 0;
  std::int64_t outside_only_below = 0;  ///< Fixed by `SmoothOptions::only_below`.
  /// Fixed because they share their position with another node of the boundary, which may move.
  std::int64_t coincident = 0;
  std::int64_t paired = 0;  ///< Held by `JobInput::node_pairs`.
  /// With BoundaryPolicy::slide, of the nodes on the boundary and between regions; the rest of them
  /// is fixed. With `Optimize` on a curved surface mesh, of all nodes.
  std::int64_t sliding_in_plane = 0;
  std::int64_t sliding_on_line = 0;
  std::int64_t curved = 0;              ///< Fixed: a part around them is neither planar nor smooth.
  std::int64_t sliding_on_surface = 0;  ///< On a curved part.
  std::int64_t sliding_on_curve = 0;    ///< Along a crease that is not straight.
  /// On edges that three or more elements of a surface mesh share. They are fixed; with `Optimize`
  /// on a curved surface mesh those edges are creases, along which they slide unless the boundary
  /// is fixed.
  std::int64_t on_non_manifold_edges = 0;
};

/// With BoundaryPolicy::slide on curved parts, and with `Optimize` on a curved surface mesh, where
/// nodes slide on the facets of the input: the two one-sided deviations (Hausdorff) between the
/// boundary, or the surface, before and after, in the mesh's unit. 0 where no part is curved.
struct BoundaryDeviation {
  double tolerance = 0;        ///< Bound on `result_to_input` from rounding.
  double result_to_input = 0;  ///< Largest distance of a sliding node from the input's facets.
  double input_to_result = 0;  ///< Largest distance of an input position from the result.
};

/// The elements of the result below `SmoothOptions::report_below`, by what holds them there. Of
/// second order it is the mesh of their corners; with `Optimize::stay`, `only_below` or a movement
/// limit as the sweeps left it, before curved elements were repaired or went back.
struct PoorElements {
  double below = 0;  ///< A mean ratio, against the target.
  std::int64_t element_count = 0;
  std::int64_t locked_count = 0;  ///< All nodes are fixed.
  /// Of the others, those limited by connectivity: no allowed move of one of their nodes would
  /// lower the energy of its ball by 0.1 % or more.
  std::int64_t limited_count = 0;
};

/// How far `Move` came.
struct MotionStats {
  /// The share of the motion that the result has, [0, 1]: a prescribed node lies at
  /// reference + reached * (prescribed - reference), with 1 exactly where it was prescribed.
  double reached = 1;
  int step_count = 0;              ///< Steps that led to a valid mesh; one unless it is hard.
  int rejected_step_count = 0;     ///< Steps that did not lead to a valid mesh.
  int linear_iteration_count = 0;  ///< Of the conjugate gradients.
  double linear_residual = 0;      ///< Relative, at their end.
  double linear_seconds = 0;       ///< To assemble and to solve.
  /// Elements still inverted in the shortest rejected step, and the first of them, at most
  /// `kMostBlockingElements`.
  std::int64_t blocking_element_count = 0;
  std::vector<std::int64_t> blocking_elements;
};
inline constexpr std::size_t kMostBlockingElements = 10;

/// Distances, in the mesh's unit.
struct SurfaceDistance {
  double largest = 0;
  double mean = 0;
};

/// The nodes of a patch or a curve of a target surface.
struct TargetPart {
  bool curve = false;
  std::int64_t node_count = 0;
  SurfaceDistance distance;  ///< Of its nodes in the result.
};

/// How far the boundary came onto `JobInput::surface`.
struct FitStats {
  SurfaceCounts surface;
  std::int64_t node_count = 0;     ///< Of the boundary, with a place on the surface.
  std::int64_t reached_count = 0;  ///< Of these, those that lie there in the result.
  std::int64_t held_count = 0;     ///< Of the rest, those that elements would not stay valid with.
  /// Of the boundary, without a place: fixed by the caller, between regions, or in a pair.
  std::int64_t fixed_count = 0;
  /// Corners and curves of the surface for which the boundary has no node and no path.
  std::int64_t unmatched_corner_count = 0;
  std::int64_t unmatched_curve_count = 0;
  int step_count = 0;  ///< Steps towards the surface.
  /// Nodes lay farther off in the input than 1e-6 of the box: `never_worse` does not apply.
  bool input_off_surface = false;
  SurfaceDistance input_to_surface;  ///< Of those nodes from where they belong.
  SurfaceDistance result_to_surface;
  SurfaceDistance surface_to_result;  ///< Of the surface's points from the boundary's facets.
  std::vector<TargetPart> parts;      ///< The patches, then the curves; none if over 1,000.

  /// @returns the share of the nodes that lie where they belong, [0, 1]
  [[nodiscard]] double reached() const {
    return node_count == 0 ? 1
                           : static_cast<double>(reached_count) / static_cast<double>(node_count);
  }
};

/// What `SmoothOptions::never_worse` took back: nodes that went back to their input positions, by
/// what would have been lower than in the input.
struct KeptQuality {
  QualityMetric metric = QualityMetric::mean_ratio;  ///< The one in force.
  std::int64_t for_mean_ratio = 0;                   ///< The least mean ratio.
  std::int64_t for_scaled_jacobian = 0;              ///< The least scaled Jacobian.
  std::int64_t for_mean = 0;                         ///< The mean of the metric in force.

  [[nodiscard]] std::int64_t restored_node_count() const {
    return for_mean_ratio + for_scaled_jacobian + for_mean;
  }
};

/// By which share of it `SmoothOptions::never_worse` lets a mean fall.
inline constexpr double kMostMeanLoss = 0.001;

/// A measure of a result that is lower than in its input.
struct LowerMeasure {
  QualityMetric metric = QualityMetric::mean_ratio;
  bool mean = false;  ///< Else the least value.
  double before = 0;
  double after = 0;
};

/// Times of the stages of a job.
struct StageTimes {
  double upload_seconds = 0;
  double find_neighbours_seconds = 0;
  double find_boundary_seconds = 0;
  double iterate_seconds = 0;
  double evaluate_seconds = 0;
  double download_seconds = 0;
};

/// The report on a job.
struct SmoothSummary {
  StopReason stop_reason = StopReason::converged;
  Convergence convergence;
  QualityStats quality_before;
  QualityStats quality_after;
  /// Of the result, with SmoothOptions::element_quality_metrics.
  ElementQualityArrays element_quality;
  LockedStats locked;
  std::optional<PoorElements> poor;         ///< With SmoothOptions::report_below.
  std::optional<MotionStats> motion;        ///< Of `Move`.
  std::optional<FitStats> fit;              ///< With JobInput::surface.
  std::optional<KeptQuality> kept_quality;  ///< With SmoothOptions::never_worse.
  NodeCounts nodes;
  BoundaryDeviation deviation;
  /// Elements that are flat or inverted in the reference: they aim at their ideal shape.
  std::int64_t flat_reference_element_count = 0;
  StageTimes times;
  std::string backend;  ///< "cpu", "cuda:0".
  std::string device_name;
  int thread_count = 0;
  int colour_count = 0;
  std::int64_t host_peak_bytes = 0;  ///< Allocated by this job, without the caller's arrays.
  std::int64_t device_peak_bytes = 0;
};

/// Finds what is worse than in the input: a least mean ratio or scaled Jacobian lower by more than
/// 1e-6, and a mean by more than `kMostMeanLoss`, of the metric in force where one is.
///
/// @returns nothing of `Move`, whose boundary moves, nor of a brief evaluation
[[nodiscard]] std::vector<LowerMeasure> find_lower(const SmoothSummary& summary);

}  // namespace meshsmooth

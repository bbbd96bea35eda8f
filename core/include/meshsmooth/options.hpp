#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/method_traits.hpp"
#include "meshsmooth/quality.hpp"
#include "meshsmooth/target_surface.hpp"

namespace meshsmooth {

/// When a method has converged: the largest move of a sweep is below `value`. For `Optimize` with a
/// relative tolerance: a sweep lowers the p-norm of a ball's inverse mean ratios by less than this
/// share, in the mean over the nodes that still move, and the sweeps to come are estimated to add
/// little (docs/methods.md, Termination). It does not depend on the size of the mesh.
struct Tolerance {
  double value = 1e-4;   ///< Finite, >= 0.
  bool relative = true;  ///< As a share of the bounding box's diagonal; else in the mesh's unit.
};

/// The largest distance of a node from its original position, to the rounding of the coordinates.
struct MovementLimit {
  double value = 0;       ///< Finite, > 0.
  bool relative = false;  ///< As a share of the bounding box's diagonal; else in the mesh's unit.
};

/// Restricts a job to bad elements: all nodes are fixed but those of elements with a mean ratio,
/// for `Optimize` against their target, below `quality`, and of `rings` rings around them.
struct OnlyBelow {
  double quality = 0;  ///< (0, 1].
  int rings = 2;       ///< >= 0.
};

/// New positions of some nodes, for `Move`; not owned.
struct PrescribedNodes {
  std::span<const NodeId> nodes = {};  ///< Each once; none of them is fixed by the caller.
  /// [nodes.size()], in the mesh's unit. With Derivative::tangent their tangents instead; empty
  /// with Derivative::cotangent.
  PositionsView positions = {};
};

/// Two nodes that belong together, as on periodic sides.
using NodePair = std::array<NodeId, 2>;

/// What a job is given besides its mesh and its options: arrays, not owned; each may be empty.
struct JobInput {
  /// Of `Optimize`: positions of the mesh in which each element has its target shape, [node_count]
  /// in the mesh's unit. What slides where is read from it too. With it, `Target::automatic` is
  /// `Target::reference`.
  PositionsView reference = {};
  PrescribedNodes prescribed = {};  ///< Of `Move`, which needs at least one.
  /// Of `Move` with Derivative::cotangent: [node_count], the derivatives of a scalar by the
  /// displacements of all nodes; those of fixed nodes do not count. It may lie where the result
  /// will, unless the types of the reference and the result differ.
  PositionsView cotangent = {};
  /// Nodes that belong together; a node may be in several pairs. They are held, not moved together,
  /// by every method and boundary policy. Of `Move`, prescribed ones go where they are prescribed:
  /// both of a pair, or none.
  std::span<const NodePair> node_pairs = {};
  /// Of `Optimize` with BoundaryPolicy::slide on first-order volume elements: the surface on which
  /// boundary nodes are to lie: SmoothSummary::fit. Null: none.
  const SurfaceMesh* surface = nullptr;
};

/// The options of a job. The defaults are those of the wire and of the command line.
struct SmoothOptions {
  Method method = Optimize{};
  Form form = Form::automatic;
  /// Iteration limit, >= 0; 0 only evaluates the mesh. Unset: the method's own (`iteration_limit`).
  std::optional<int> max_iterations = {};
  Tolerance tolerance = {};
  BoundaryPolicy boundary = BoundaryPolicy::fixed;
  /// With BoundaryPolicy::slide: planes that meet at less than this angle form one curved part, and
  /// creases that turn by less one curved crease. With `Optimize` the same of the elements of a
  /// curved surface mesh. In degrees, [1, 90].
  double feature_angle = 30;
  bool guard = true;  ///< A valid element stays valid.
  TangledPolicy tangled = TangledPolicy::repair;
  /// Computing time after which the best result so far is returned, > 0; unset: no limit.
  std::optional<std::chrono::nanoseconds> compute_budget = {};
  std::optional<MovementLimit> movement_limit = {};  ///< Unset: no limit.
  /// A result is not worse than its input: nodes go back until the least quality of the elements
  /// that may move is no lower, and the mean by 0.1 % at most, where elements were
  /// not untangled instead. Of every method but `Move`; not without `guard`.
  bool never_worse = true;
  /// The metric of `never_worse`, `mean_ratio` or `scaled_jacobian`; with the latter `Optimize`
  /// ends with sweeps that raise its least value, but for Goal::average. Unset: the least values of
  /// both are kept, and the mean of the mean ratio where all elements are simplices, else of the
  /// scaled Jacobian.
  std::optional<QualityMetric> metric = {};
  bool history = false;  ///< Statistics of each sweep in the summary.
  QualityDetail quality_detail = QualityDetail::full;
  std::optional<OnlyBelow> only_below = {};  ///< Unset: all nodes may move.
  /// Of `Optimize`: a mean ratio against the target, (0, 1]; elements of the result below it are
  /// classified by the constraint that prevents improvement, which costs one sweep:
  /// SmoothSummary::poor. Unset: they are not.
  std::optional<double> report_below = {};
  /// Metrics to return for every element of the result, each once: SmoothSummary::element_quality.
  std::vector<QualityMetric> element_quality_metrics = {};
};

/// Returns `max_iterations`, or the method's own limit when it is unset.
[[nodiscard]] inline int iteration_limit(const SmoothOptions& options) {
  return options.max_iterations.value_or(default_iterations(options.method));
}

/// Returns whether `tolerance` is a share of the energy, not a length.
[[nodiscard]] inline bool converges_by_energy(const SmoothOptions& options) {
  return options.tolerance.relative && sweeps_as_optimize(options.method);
}

/// Converts a `Tolerance` or a `MovementLimit` to the mesh's unit.
template <class Length>
[[nodiscard]] double in_mesh_unit(const Length& length, double bounding_box_diagonal) {
  return length.value * (length.relative ? bounding_box_diagonal : 1.0);
}

/// Returns the largest move below which a method has converged, in the mesh's unit; 0 where
/// `Optimize` converges by its energy, and of `WindowedSinc`, which does not converge.
[[nodiscard]] inline double displacement_tolerance(const SmoothOptions& options,
                                                   double bounding_box_diagonal) {
  if (converges_by_energy(options) || is_filter(options.method)) return 0;
  return in_mesh_unit(options.tolerance, bounding_box_diagonal);
}

/// Returns whether `Optimize` aims at `JobInput::reference`, by the options alone.
[[nodiscard]] bool aims_at_reference(const SmoothOptions& options);

/// Returns the options with `Target::automatic` made definite: `Target::reference` where there is
/// one.
[[nodiscard]] SmoothOptions with_target_of(SmoothOptions options, const JobInput& input);

/// Checks that each metric is listed once.
/// @throws InvalidOption OPTION_OUT_OF_RANGE, detail "field".
void validate_metrics(std::span<const QualityMetric> metrics);

/// Checks all ranges and combinations.
/// @throws InvalidOption OPTION_OUT_OF_RANGE, detail "field".
/// @throws NotSupported OPTION_NOT_SUPPORTED, detail "field".
void validate(const SmoothOptions& options);

/// The same, and that the method takes the input.
void validate(const SmoothOptions& options, const JobInput& input);

/// Checks the nodes that `Move` prescribes. O(prescribed nodes).
/// @throws InvalidOption OPTION_OUT_OF_RANGE without any; InvalidMesh ARRAY_SIZE_MISMATCH,
///         INDEX_OUT_OF_RANGE, NON_FINITE_COORDINATE, PRESCRIBED_TWICE, PRESCRIBED_AND_FIXED,
///         detail "node"
void validate_prescribed(const TopologyView& topology, const PrescribedNodes& prescribed);

/// The same of what a derivative of `Move` is given, as its options say.
/// @throws what `validate_prescribed` throws, of the array "prescribed" or "cotangent"
void validate_motion(const TopologyView& topology, const SmoothOptions& options,
                     const JobInput& input);

/// The nodes that do not move with `JobInput::node_pairs`.
struct HeldPairs {
  std::vector<std::uint8_t> fixed;  ///< [node_count]: 1 for those and the caller's fixed nodes.
  std::int64_t paired = 0;          ///< Held by a pair, whether the caller fixed them or not.
};

/// Marks the nodes of `input.node_pairs` that are not prescribed.
/// O(nodes + pairs + prescribed nodes).
/// @throws InvalidMesh INDEX_OUT_OF_RANGE, PAIR_HALF_PRESCRIBED, detail "node";
///         ARRAY_SIZE_MISMATCH for a fixed mask of another size
[[nodiscard]] HeldPairs hold_node_pairs(const TopologyView& topology, const JobInput& input);

}  // namespace meshsmooth

#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include <array>
#include <cstddef>
#include <string_view>

namespace meshsmooth {

/// The names of the enumerators in their order, lower_snake_case.
template <class Enum>
inline constexpr std::array<std::string_view, 0> kEnumNames{};

/// @returns the name of an enumerator
template <class Enum>
[[nodiscard]] constexpr std::string_view enum_name(Enum value) {
  return kEnumNames<Enum>[static_cast<std::size_t>(value)];
}

/// @returns all enumerators in their order
template <class Enum>
[[nodiscard]] constexpr auto enum_values() {
  std::array<Enum, kEnumNames<Enum>.size()> values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<Enum>(i);
  return values;
}

/// The order in which the nodes of one sweep see each other's moves.
enum class Form {
  automatic,  ///< The method's own: `MethodTraits::forms`, the first.
  jacobi,  ///< Reads the old positions, writes new ones.
  gauss_seidel,  ///< In place, colour by colour; deterministic.
  asynchronous,  ///< In place, unordered; not deterministic.
};

template <>
inline constexpr std::array<std::string_view, 4> kEnumNames<Form> = {
    "automatic", "jacobi", "gauss_seidel", "asynchronous"};

/// The weights of a node's neighbours.
enum class Weighting {
  uniform,  ///< The mean of the 1-ring.
  inverse_edge_length,  ///< Ring node j by 1 / |x_j - x_i|.
  edge_length,  ///< Ring node j by |x_j - x_i|.
  ball_volume,  ///< Centroids of the ball's elements by their volume (area).
};

template <>
inline constexpr std::array<std::string_view, 4> kEnumNames<Weighting> = {
    "uniform", "inverse_edge_length", "edge_length", "ball_volume"};

/// How the series of `WindowedSinc` fades out.
enum class Window {
  nuttall,  ///< Keeps the size of a mesh to 0.1 %. The default of VTK from 9.4 on.
  hamming,  ///< Changes the size by up to 0.5 %. That of VTK before 9.4.
};

template <>
inline constexpr std::array<std::string_view, 2> kEnumNames<Window> = {
    "nuttall", "hamming"};

/// The quality that `Optimize` aims at.
enum class Goal {
  average,  ///< The mean: sum of the inverse mean ratios.
  balanced,  ///< The mean and the worst: sum of their squares.
  worst,  ///< The worst: sum of their fourth powers, then up to the 32nd in poor balls.
};

template <>
inline constexpr std::array<std::string_view, 3> kEnumNames<Goal> = {
    "average", "balanced", "worst"};

/// The shape that `Optimize` gives each element.
enum class Target {
  /// Its shape in `JobInput::reference`. Without one: simplices their ideal shape; other elements
  /// right angles at their own aspect ratio where it is meant, as in a boundary layer, else equal edges
  /// (docs/methods.md, Targets).
  automatic,
  ideal,  ///< The ideal shape of its type: equal edges.
  input,  ///< Its shape in the input.
  reference,  ///< Its shape in `JobInput::reference`, which must be there.
};

template <>
inline constexpr std::array<std::string_view, 4> kEnumNames<Target> = {
    "automatic", "ideal", "input", "reference"};

/// Where `Move` begins to solve for the displacement.
enum class Start {
  cold,  ///< At 0.
  /// Where the last two warm motions on the same kept reference and fixed nodes lead to, if they were
  /// smooth: fewer iterations to the same residual. The bits depend on those motions, what they differ by
  /// is within the residual.
  warm,
};

template <>
inline constexpr std::array<std::string_view, 2> kEnumNames<Start> = {
    "cold", "warm"};

/// What `Move` computes: the motion, or a product with the Jacobian matrix of its linear prediction,
/// the displacements of all nodes by those of the prescribed ones that Laplace's equation gives.
enum class Derivative {
  none,  ///< The motion.
  /// The tangents of all nodes for those of the prescribed ones (Jacobian-vector product, forward
  /// mode).
  tangent,
  /// The cotangents of the prescribed nodes for those of all nodes (vector-Jacobian product, reverse
  /// mode).
  cotangent,
};

template <>
inline constexpr std::array<std::string_view, 3> kEnumNames<Derivative> = {
    "none", "tangent", "cotangent"};

/// What nodes on the boundary and between regions may do.
enum class BoundaryPolicy {
  fixed,  ///< They stay.
  slide,  ///< They move in their plane or on their curved part, along their crease; corners stay.
  free,  ///< They move like all others.
};

template <>
inline constexpr std::array<std::string_view, 3> kEnumNames<BoundaryPolicy> = {
    "fixed", "slide", "free"};

/// What happens to a mesh that arrives with inverted elements.
enum class TangledPolicy {
  repair,  ///< The method repairs what it can; the summary counts the rest.
  refuse,  ///< `InvalidMesh` (MESH_TANGLED).
};

template <>
inline constexpr std::array<std::string_view, 2> kEnumNames<TangledPolicy> = {
    "repair", "refuse"};

/// How much the evaluation of a mesh reports.
enum class QualityDetail {
  full,  ///< Every metric of every element.
  brief,  ///< Counts of inverted and degenerate, volumes, worst elements: a third of the time.
};

template <>
inline constexpr std::array<std::string_view, 2> kEnumNames<QualityDetail> = {
    "full", "brief"};

/// The metrics that a job reports.
enum class QualityMetric {
  mean_ratio,  ///< Every type, worst corner; 1 = ideal, negative = inverted.
  /// Every type, worst corner, ideal corner = 1; a pyramid may exceed 1; of a curved element a lower bound
  /// of the least in it, by about 0.003.
  scaled_jacobian,
  radius_ratio,  ///< Tetrahedra: 3 inradius / circumradius, signed.
  min_dihedral_angle,  ///< Tetrahedra, degrees; 0 when inverted.
  max_dihedral_angle,  ///< Tetrahedra, degrees; 180 when inverted.
  min_angle,  ///< Triangles, degrees; 0 when inverted.
  max_angle,  ///< Triangles, degrees; 180 when inverted.
};

template <>
inline constexpr std::array<std::string_view, 7> kEnumNames<QualityMetric> = {
    "mean_ratio", "scaled_jacobian", "radius_ratio", "min_dihedral_angle", "max_dihedral_angle", "min_angle", "max_angle"};

/// The kind of a backend.
enum class BackendKind {
  automatic,  ///< The server chooses.
  cpu,  ///< The processor's cores.
  cuda,  ///< An NVIDIA GPU.
};

template <>
inline constexpr std::array<std::string_view, 3> kEnumNames<BackendKind> = {
    "auto", "cpu", "cuda"};

/// Whose jobs leave the queue first.
enum class Priority {
  batch,  ///< After all others.
  normal,  ///< The default.
  interactive,  ///< Before all others, for callers who may.
};

template <>
inline constexpr std::array<std::string_view, 3> kEnumNames<Priority> = {
    "batch", "normal", "interactive"};

/// The state of a job.
enum class JobState {
  unspecified,  ///< Of no job; a state that a newer server reports.
  receiving,  ///< Its data arrives.
  queued,  ///< It waits for a lane.
  running,  ///< It computes.
  sending,  ///< Its result leaves.
  succeeded,  ///< Its result is there.
  failed,  ///< It ended with an error.
  cancelled,  ///< Its caller ended it.
  expired,  ///< It succeeded, and its result was kept; the result is gone.
};

template <>
inline constexpr std::array<std::string_view, 9> kEnumNames<JobState> = {
    "unspecified", "receiving", "queued", "running", "sending", "succeeded", "failed", "cancelled", "expired"};

/// The stages of a job, in order.
enum class Stage {
  find_neighbours,  ///< The topology of the mesh.
  find_boundary,  ///< Boundary, regions and constraints.
  iterate,  ///< The sweeps.
  evaluate,  ///< Quality before or after.
};

template <>
inline constexpr std::array<std::string_view, 4> kEnumNames<Stage> = {
    "find_neighbours", "find_boundary", "iterate", "evaluate"};

/// Why a job stopped.
enum class StopReason {
  converged,  ///< The largest move fell below the tolerance.
  target_reached,  ///< The worst element reached `Optimize::target_quality`.
  iteration_limit,  ///< `SmoothOptions::max_iterations` were done.
  compute_budget,  ///< `SmoothOptions::compute_budget` was used up.
  stagnated,  ///< Nodes are held back, or moves no longer shrink.
  cancelled_with_result,  ///< Cancelled by a caller who wants the positions reached.
};

template <>
inline constexpr std::array<std::string_view, 6> kEnumNames<StopReason> = {
    "converged", "target_reached", "iteration_limit", "compute_budget", "stagnated", "cancelled_with_result"};

/// The rule by which a job converged or stagnated.
enum class EndRule {
  none,  ///< It ended by a limit, a target or the caller.
  at_rest,  ///< No node moves any more.
  small_moves,  ///< The largest move fell below the tolerance.
  small_gains,  ///< `Optimize`: further sweeps would lower the energy by less than the tolerance.
  no_progress,  ///< Moves no longer shrink; `Optimize`: tangled balls do not become better.
  all_held,  ///< Every move was rejected.
};

template <>
inline constexpr std::array<std::string_view, 6> kEnumNames<EndRule> = {
    "none", "at_rest", "small_moves", "small_gains", "no_progress", "all_held"};

/// Metrics for acceptance criteria, besides those that a job reports. They are computed on the CPU.
/// Infinite where their denominator is zero or, for `condition_number`, a corner is inverted.
enum class ShapeMetric {
  aspect_ratio,  ///< Longest edge over a height, 1 = ideal. Triangles, quads, tetrahedra.
  edge_ratio,  ///< Longest edge over the shortest, at least 1. All types.
  /// Deviation of the angles of the faces from 60 or 90 degrees, in tetrahedra also of those between the
  /// faces from acos(1/3): 0 = ideal, 1 = flat, above 1 with an angle of more than 180 degrees. All types.
  equiangle_skew,
  condition_number,  ///< Of the Jacobian matrix, worst corner, 1 = ideal. All types but pyramids.
  /// Angle between the normal of a face and the line between the centres of its two elements, in degrees;
  /// the largest over the faces that the element shares. Volume elements that share one.
  non_orthogonality,
  /// Distance between the centre of a face and that line, over the size of the face; the largest over the
  /// faces of the element. Volume elements.
  skewness,
};

template <>
inline constexpr std::array<std::string_view, 6> kEnumNames<ShapeMetric> = {
    "aspect_ratio", "edge_ratio", "equiangle_skew", "condition_number", "non_orthogonality", "skewness"};

}  // namespace meshsmooth

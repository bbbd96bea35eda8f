#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include <variant>

#include "meshsmooth/enums.hpp"

namespace meshsmooth {

/// Moves each node towards the weighted mean of its neighbours:
/// x' = x + relaxation * (weighted mean - x). Inverts elements unless guarded.
///
/// Source: Xiao et al. 2019, eq. 1, for the uniform weights. O(edges) per sweep.
struct Laplacian {
  Weighting weighting = Weighting::uniform;  ///< Weights of the neighbours.
  double relaxation = 1.0;  ///< Share of the step that is taken, (0, 1].
};

/// A Laplacian step that is taken only if the worst mean ratio of the node's ball does not fall;
/// the step is halved up to three times first.
///
/// Source: Freitag 1997, "On combining Laplacian and optimization-based mesh smoothing techniques".
/// O(elements) per sweep.
struct SmartLaplacian {
  Weighting weighting = Weighting::uniform;  ///< Weights of the neighbours.
  double relaxation = 1.0;  ///< Share of the step that is taken, (0, 1].
};

/// A Laplacian step with lambda, then one with mu: a low-pass filter that keeps the volume of a
/// surface. The pass band ends at 1/lambda + 1/mu = 0.1 by default.
///
/// Source: Taubin 1995, "A signal processing approach to fair surface design", eq. 5. O(edges) per
/// iteration.
struct Taubin {
  double lambda = 0.6307;  ///< Factor of the first step, (0, 1].
  double mu = -0.6732;  ///< Factor of the second step, below minus lambda.
};

/// Averages, then pushes the nodes back towards their original and previous positions.
///
/// Source: Vollmer, Mencl, Müller 1999, "Improved Laplacian smoothing of noisy surface meshes",
/// section 4. O(edges) per sweep.
struct HcLaplacian {
  double alpha = 0.0;  ///< Weight of the original position, [0, 1].
  double beta = 0.5;  ///< Share of the node's own difference, [0, 1].
};

/// Moves each node down the energy of its ball: the sum over the element corners around it of f^p,
/// with f the inverse mean ratio against the corner of the element's target; the corner weights
/// of an element sum to one. A visit is one exact Newton step on the p-norm, colour by colour.
///
/// A valid element stays valid and the energy never rises; tangled balls are untangled first, by
/// the regularized energy. A target has a shape, no size.
///
/// On a surface mesh that is not plane the nodes stay on the facets of the input: those on feature
/// edges along them, corners where they are (`SmoothOptions::feature_angle`); the summary has how
/// far (`BoundaryDeviation`).
///
/// Sources: Knupp 2001, "Algebraic mesh quality metrics", for the mean ratio; Garanzha et al. 2021,
/// "Foldover-free maps in 50 lines of code", for the regularization. O(elements) per sweep.
struct Optimize {
  Goal goal = Goal::balanced;  ///< Elements to improve: all, the worst, or both.
  /// The run ends once the worst mean ratio of the elements that are not locked reaches this; with
  /// Goal::worst only balls below it are refined. [0, 1); 0: no target.
  double target_quality = 0.0;
  Target target = Target::automatic;  ///< Shape that elements aim at.
  /// Holds each node near its input position: adds this times its squared distance from there, over the
  /// mean squared length of the edges at it, to the energy. >= 0.
  double stay = 0.0;
};

/// A low-pass filter: the series of Chebyshev polynomials of the ring operator K x = x - mean of
/// the ring that approximates a step, one term per iteration. Components of K's eigenvalue below
/// the pass band stay, those above vanish; the more iterations, the sharper. As
/// vtkWindowedSincPolyDataFilter with NormalizeCoordinates on, but fixed nodes keep their
/// positions, and the mesh keeps its size where VTK finds no offset of the step.
///
/// The iterations end at their limit, at most `kMostFilterIterations`; the tolerance does not end
/// them. Guard, sliding and movement limit act once, on the result.
///
/// Source: Taubin, Zhang, Golub 1996, "Optimal surface smoothing as filter design". O(edges) per
/// iteration.
struct WindowedSinc {
  Window window = Window::nuttall;  ///< Window of the filter's series.
  /// Eigenvalue of the ring operator below which the shape stays, [0.001, 2].
  double pass_band = 0.1;
};

/// Moves nodes to given positions (`JobInput::prescribed`) and lets the rest of the mesh
/// follow. The positions that the job brings are the reference: a valid mesh, whose boundary, what
/// slides where, and element shapes count. Regions do not: what lies between them follows. The
/// result depends on it and on the prescribed positions alone, not on the way there: after a cycle
/// the mesh is the reference, bit for bit (`Start::warm` excepted).
///
/// The displacement is continued into the mesh by Laplace's equation on the reference, solved by
/// conjugate gradients to a residual of 1e-4; then the sweeps of `Optimize` bring each element
/// near its target, and a higher power of their energy raises the worst ones. Where they cannot
/// untangle the mesh, or only by folds, the motion is halved and goes on from there. The result is
/// always valid; `MotionStats` tells which share of the motion it has reached.
///
/// Sources: Jasak, Tukovic 2006, "Automatic mesh motion for the unstructured finite volume method",
/// for Laplace's equation; those of `Optimize` for the sweeps. O(elements) per sweep, O(edges) per
/// iteration of the solver.
struct Move {
  Target target = Target::automatic;  ///< Target::ideal, or the reference by any other name.
  /// The smallest share of the motion that is tried before the job gives up, (0, 1].
  double least_step = 0.015625;
  Start start = Start::cold;  ///< Start of the solver; warm: from earlier motions of a session.
  /// What is computed: the motion, or a derivative of its linear prediction on the reference, which no
  /// sweep changes and no limit of them concerns. It is solved in double to a residual of 1e-13, so that
  /// tangents and cotangents are exact transposes: docs/move.md, Derivatives.
  Derivative derivative = Derivative::none;
};

/// A smoothing method with its parameters; `MethodTraits` describes each.
using Method =
    std::variant<Laplacian, SmartLaplacian, Taubin, HcLaplacian, Optimize, WindowedSinc, Move>;

/// Whether a method moves nodes to prescribed positions.
[[nodiscard]] inline bool is_motion(const Method& method) {
  return std::holds_alternative<Move>(method);
}

/// What a method computes in place of a motion.
[[nodiscard]] inline Derivative derivative_of(const Method& method) {
  const auto* move = std::get_if<Move>(&method);
  return move != nullptr ? move->derivative : Derivative::none;
}

/// Whether the iterations of a method are the terms of a filter, which does not converge.
[[nodiscard]] inline bool is_filter(const Method& method) {
  return std::holds_alternative<WindowedSinc>(method);
}

/// Whether a method sweeps as `Optimize` does.
[[nodiscard]] inline bool sweeps_as_optimize(const Method& method) {
  return std::holds_alternative<Optimize>(method) || is_motion(method);
}

}  // namespace meshsmooth

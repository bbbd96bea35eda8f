#pragma once

#include <variant>

namespace meshsmooth {

/// How a node weighs what surrounds it.
enum class Weighting {
  uniform,              // mean of the ring
  inverse_edge_length,  // ring node j by 1 / |x_j - x_i|
  edge_length,          // ring node j by |x_j - x_i|
  ball_volume,          // centroids of the ball's elements by their volume (area)
};

/// x' = x + relaxation * (weighted mean - x). Source: Xiao et al. 2019, eq. 1,
/// for the uniform weights. Inverts elements unless guarded.
struct Laplacian {
  Weighting weighting = Weighting::uniform;
  double relaxation = 1.0;  // (0, 1]
};

/// Laplacian whose move is taken only if the worst mean ratio of the node's
/// ball does not fall; the step is halved up to three times first. Source:
/// Freitag 1997, "On combining Laplacian and optimization-based mesh smoothing
/// techniques".
struct SmartLaplacian {
  Weighting weighting = Weighting::uniform;
  double relaxation = 1.0;  // (0, 1]
};

/// A Laplacian step with lambda, then one with mu. Source: Taubin 1995, "A
/// signal processing approach to fair surface design", eq. 5; pass band
/// 1/lambda + 1/mu = 0.1 by default.
struct Taubin {
  double lambda = 0.6307;  // (0, 1]
  double mu = -0.6732;     // < -lambda
};

/// Pushes averaged nodes back. Source: Vollmer, Mencl, Müller 1999, "Improved
/// Laplacian smoothing of noisy surface meshes", section 4.
struct HcLaplacian {
  double alpha = 0.0;  // [0, 1], weight of the original position
  double beta = 0.5;   // [0, 1], share of the node's own difference
};

/// What an optimized mesh is to be good at.
enum class Goal {
  average,   // the mean: sum of the inverse mean ratios
  balanced,  // the mean and the worst: sum of their squares
  worst,     // the worst: sum of their fourth powers, then up to the 32nd in poor balls
};

/// Moves each node down the energy of its ball: the sum over the element corners
/// around it of f^p, with f the inverse mean ratio against the element type's own ideal
/// corner; the corners of an element weigh one together. One exact Newton step on the p-norm a
/// visit, colour by colour. A valid element stays valid and the energy never rises; tangled balls
/// are untangled by the regularized energy first. The ideal has no size, so a graded mesh stays
/// graded. Sources: Knupp 2001, "Algebraic mesh quality metrics", for the mean ratio; Garanzha et
/// al. 2021, "Foldover-free maps in 50 lines of code", for the regularization.
struct Optimize {
  Goal goal = Goal::balanced;
  /// Ends once the worst mean ratio of the elements that are not locked is this good;
  /// with Goal::worst only balls below it are refined. [0, 1); 0: no target.
  double target_quality = 0;
};

using Method = std::variant<Laplacian, SmartLaplacian, Taubin, HcLaplacian, Optimize>;

}  // namespace meshsmooth

#pragma once

#include <string_view>
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

using Method = std::variant<Laplacian, SmartLaplacian, Taubin, HcLaplacian>;

/// "laplacian", "smart_laplacian", "taubin", "hc_laplacian".
[[nodiscard]] std::string_view method_name(const Method& method);

}  // namespace meshsmooth

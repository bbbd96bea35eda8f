#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "meshsmooth/methods.hpp"

namespace meshsmooth::detail {

/// The filter of `WindowedSinc`, f(K) = sum over k <= N of c_k T_k(I - K / 2), designed once for a
/// job on the host. The step from 1 to 0 lies behind the end of the pass band, by an offset that
/// makes f there 1.
///
/// Summed by parts, f(K) x = f(0) x + sum over k >= 1 of r_{k-1} (T_k - T_{k-1}) x with
/// r_k = c_{k+1} + ... + c_N: every term is a move, so that the positions after any of them are
/// those of a mesh, and roundings are those of moves.
///
/// Source: Taubin, Zhang, Golub 1996, sections 5 and 6; the search as in
/// vtkWindowedSincPolyDataFilter. O(500 N).
class WindowedSincFilter {
 public:
  /// N = term_count >= 1.
  WindowedSincFilter(const WindowedSinc& method, int term_count)
      : window_(method.window),
        term_count_(term_count),
        band_(std::acos(1 - method.pass_band / 2)),
        remaining_(static_cast<std::size_t>(term_count)) {
    const std::optional<double> edge = find_edge();
    double sum = 0;
    for (int k = term_count; k >= 1; --k) {
      sum += coefficient(k, edge.value_or(band_));
      remaining_[static_cast<std::size_t>(k) - 1] = sum;
    }
    if (edge) scale_ = sum + coefficient(0, *edge);
  }

  /// f(0), the factor of the mesh's size. Where no offset is found (most series of one to four
  /// terms) the missing part is added to c_0: 1.
  [[nodiscard]] double scale() const { return scale_; }
  /// The factor r_{k-1} of the k-th move, 1 <= k <= N.
  [[nodiscard]] double factor(int k) const { return remaining_[static_cast<std::size_t>(k) - 1]; }

 private:
  /// Of angle 0 at the first and nearly pi at the last term. Nuttall's is the continuous one:
  /// Nuttall 1981, "Some windows with very good sidelobe behavior".
  [[nodiscard]] double window_at(int k) const {
    const double angle = k * std::numbers::pi / (term_count_ + 1);
    if (window_ == Window::hamming) return 0.54 + 0.46 * std::cos(angle);
    return 0.355768 + 0.487396 * std::cos(angle) + 0.144232 * std::cos(2 * angle) +
           0.012604 * std::cos(3 * angle);
  }

  /// c_k of the step at this angle.
  [[nodiscard]] double coefficient(int k, double edge) const {
    const double share = k == 0 ? edge : 2 * std::sin(k * edge) / k;
    return window_at(k) * share / std::numbers::pi;
  }

  /// The angle of the step that makes f at the end of the pass band 1, to 0.001. The slope is
  /// VTK's: it leaves out the last term and counts the constant part of the odd ones twice. The
  /// search ends far from the root, so that another slope would give another filter.
  [[nodiscard]] std::optional<double> find_edge() const {
    constexpr int kMostTurns = 500;
    constexpr double kTolerance = 1e-3;
    if (term_count_ == 1) return std::nullopt;
    double edge = band_;
    for (int turn = 0; turn < kMostTurns; ++turn) {
      double response = coefficient(0, edge), slope = 0;
      for (int k = 1; k <= term_count_; ++k) {
        const double c = coefficient(k, edge);
        response += c * std::cos(k * band_);
        if (k < term_count_)
          slope += k * c * (std::sin(k * band_) / std::sin(band_) + (k % 2 != 0 ? 1 : 0));
      }
      if (std::abs(response - 1) < kTolerance) return edge;
      edge -= (response - 1) / slope;
    }
    return std::nullopt;
  }

  Window window_;
  int term_count_;
  double band_;  // the angle of the pass band's end: cos(angle) = 1 - K / 2
  std::vector<double> remaining_;
  double scale_ = 1;
};

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "smooth/energy/newton_step.hpp"

namespace meshsmooth::detail {

/// A Bézier coefficient of the Jacobian of an element at a node, which is linear in the node's
/// move.
struct LinearCoefficient {
  double value;
  Vec3d gradient;

  [[nodiscard]] double after(Vec3d move) const { return value + dot(gradient, move); }
};

/// How near a coefficient, as a share of its element's mean, is to it: 1 at the mean.
[[nodiscard]] inline double nearness(double c) { return c <= 1 ? c : 1 / c; }

/// @returns the nearness of the coefficient that is worst after a move, at most 1
[[nodiscard]] inline double worst_after(std::span<const LinearCoefficient> terms, Vec3d move) {
  double worst = 1;
  for (const LinearCoefficient& term : terms) worst = std::min(worst, nearness(term.after(move)));
  return worst;
}

/// The sum of 1 / h(c - b) over coefficients c, h(d) = (d + sqrt(d² + 4 δ²)) / 2: convex, and large
/// where a coefficient is not above the barrier b. Of a positive barrier also that of
/// 1 / h(1 / b - c), so that it is large too where a coefficient is not below 1 / b.
class CoefficientEnergy {
 public:
  /// Where δ is 0, all coefficients must lie between the barriers.
  CoefficientEnergy(std::span<const LinearCoefficient> terms, double barrier, double delta)
      : terms_(terms), barrier_(barrier), delta_(delta) {}

  /// @returns the move that lowers it most, by Newton's method with halved steps
  [[nodiscard]] Vec3d minimize() const {
    Vec3d move{0, 0, 0};
    BallDerivatives now = at(move);
    for (int iteration = 0; iteration < 6; ++iteration) {
      Vec3d step = newton_step(now).direction;
      BallDerivatives next = at(move + step);
      for (int k = 0; k < 10 && !(next.energy < now.energy); ++k) {
        step = 0.5 * step;
        next = at(move + step);
      }
      if (!(next.energy < now.energy)) break;
      move += step;
      if (!(next.energy < now.energy * (1 - 1e-6))) break;
      now = next;
    }
    return move;
  }

 private:
  [[nodiscard]] BallDerivatives at(Vec3d move) const {
    BallDerivatives sum{};
    for (const LinearCoefficient& term : terms_) {
      const double c = term.after(move);
      add(c - barrier_, term.gradient, sum);
      if (barrier_ > 0) add(1 / barrier_ - c, -1 * term.gradient, sum);
    }
    const double small = 1e-6 * (sum.xx + sum.yy + sum.zz);  // in a plane one direction is free
    sum.xx += small, sum.yy += small, sum.zz += small;
    return sum;
  }

  /// Adds 1 / h of a distance with gradient `a`.
  void add(double distance, Vec3d a, BallDerivatives& sum) const {
    const double r = std::sqrt(distance * distance + 4 * delta_ * delta_);
    const double of_h = 2 / (distance + r), of_r = 1 / r;
    const double second = 2 * of_r * of_r * of_r;
    sum.energy += of_h;
    sum.gradient += (-of_h * of_r) * a;
    sum.xx += second * a.x * a.x, sum.xy += second * a.x * a.y, sum.xz += second * a.x * a.z;
    sum.yy += second * a.y * a.y, sum.yz += second * a.y * a.z, sum.zz += second * a.z * a.z;
  }

  std::span<const LinearCoefficient> terms_;
  double barrier_;
  double delta_;
};

}  // namespace meshsmooth::detail

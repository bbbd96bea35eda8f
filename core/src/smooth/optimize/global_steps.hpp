#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "smooth/base/positions.hpp"
#include "smooth/energy/mesh_derivatives.hpp"
#include "smooth/linear/solve_laplace.hpp"
#include "smooth/optimize/optimize_sweeper.hpp"

namespace meshsmooth::detail {

/// Bytes of `GlobalSteps`.
[[nodiscard]] inline std::int64_t global_steps_bytes(const MeshCounts& mesh) {
  return laplace_bytes(mesh) + mesh.nodes * (7 * std::int64_t{sizeof(Vec3f)} + mesh.position_bytes);
}

/// The residual, preconditioned by the diagonal.
struct ByDiagonal {
  const float* diagonal;
  const Vec3f* residual;

  [[nodiscard]] MESHSMOOTH_HD Vec3f operator()(std::size_t node) const {
    return diagonal[node] > 0 ? (1 / diagonal[node]) * residual[node] : Vec3f{0, 0, 0};
  }
};

/// Scalar products that a new direction needs.
struct DirectionProducts {
  double gradient = 0;  // with the solution
  double change = 0;    // of the gradient's change with it
  double along = 0;     // of the gradient with the last direction

  friend MESHSMOOTH_HD DirectionProducts operator+(const DirectionProducts& a,
                                                   const DirectionProducts& b) {
    return {a.gradient + b.gradient, a.change + b.change, a.along + b.along};
  }
};

/// Steps of all nodes of a valid mesh together, which remove the long errors that sweeps only
/// diffuse: nonlinear conjugate gradients (Polak and Ribière) on the mesh's energy, preconditioned
/// by `differentiate_row`'s matrix, which is solved roughly. How many are needed does not depend on
/// the size of the mesh. A step is taken only where every element stays certainly valid and the
/// energy falls, so no promise of the sweeps is touched. Anchors are left out.
///
/// Sources: Kovalsky, Galun, Lipman 2016, "Accelerated quadratic proxy for geometric optimization";
/// Rabinovich et al. 2017, "Scalable locally injective mappings", for the weights of each step.
/// cost   per step a pass over the balls, one over the rings per inner iteration, two or more over
///        the elements; `global_steps_bytes`
/// order  deterministic
template <Executor E, class Real>
class GlobalSteps {
 public:
  /// `unit` as in `MeshDerivatives`.
  GlobalSteps(E& executor, OptimizeSweeper<E, Real>& sweeper, std::size_t ring_entries, int power,
              double unit)
      : executor_(executor),
        sweeper_(sweeper),
        rule_{power, unit},
        energy_(sweeper.measure(power)),
        values_(executor.template allocate<float>(ring_entries)),
        diagonal_(executor.template allocate<float>(node_count())),
        from_(executor.template allocate<Vec3<Real>>(node_count())) {
    for (auto& vector : vectors_) vector = executor.template allocate<Vec3f>(node_count());
  }

  /// Before a sweep.
  void begin() {}

  /// After a sweep. Returns by how much further than by the sweep alone the energy fell, >= 1.
  double extrapolate() {
    constexpr int kStepsOfSweep = 3;  // more conjugate directions than one, for small meshes
    const MeshEnergy before = energy_;
    const MeshEnergy plain = energy_ = sweeper_.measure(rule_.power);
    if (plain.invalid > 0) return 1;
    bool moves = true;
    for (int n = 0; moves && n < kStepsOfSweep; ++n) moves = step();
    fall_ = (before.energy - energy_.energy) / (rule_.power * before.energy);
    if (!(energy_.energy < plain.energy)) return 1;
    sweeper_.wake_all();
    const double fall = before.energy - plain.energy;
    return fall > 0 ? (before.energy - energy_.energy) / fall : 1;
  }

  /// By how much of itself the mean energy has fallen in the last sweep and the steps after it.
  [[nodiscard]] double relative_fall() const { return fall_; }

  // Public, as functors for device code must not be made in private members.

  [[nodiscard]] std::size_t node_count() const { return sweeper_.around().node_count; }

  /// Whether the energy fell.
  bool step() {
    executor_.check();
    if (sweeper_.surface()) {
      differentiate<2>();
    } else {
      differentiate<3>();
    }
    solve();
    const double slope = turn();
    return slope < 0 && search(slope);
  }

  /// Fills the matrix, the gradient and its change; of free nodes along where they may move.
  template <int kDimension>
  void differentiate() {
    const Surroundings around = sweeper_.around();
    const MeshDerivatives rule = rule_;
    const Vec3<Real>* const x = sweeper_.positions();
    float* const values = values_.data();
    float* const diagonal = diagonal_.data();
    Vec3f* const gradient = data(kGradient);
    Vec3f* const change = data(kChange);
    const bool restarts = restarts_;
    executor_.for_each(node_count(), [=] MESHSMOOTH_HD(std::size_t node) {
      Vec3f own{0, 0, 0};
      if (around.fixed[node] == 0) {
        own = allowed_part(around.sliding, node,
                           vec3_cast<float>(differentiate_row<kDimension>(around, x, rule, node,
                                                                          values, diagonal)));
      }
      change[node] = restarts ? own : own - gradient[node];
      gradient[node] = own;
    });
  }

  /// Solves the matrix times the solution = minus the gradient by linear conjugate gradients, to a
  /// tenth: three times less took as many steps, three times more a half more.
  void solve() {
    constexpr double kRough = 0.1;
    constexpr int kMostIterations = 300;
    const std::size_t n = node_count();
    const Surroundings around = sweeper_.around();
    const LaplaceMatrix matrix{around.rings, values_.data()};
    const Vec3f* const gradient = data(kGradient);
    Vec3f* const u = data(kSolution);
    Vec3f* const r = data(kResidual);
    Vec3f* const p = data(kInner);
    Vec3f* const ap = data(kProduct);
    const ByDiagonal preconditioned{diagonal_.data(), r};
    double now = executor_.reduce(
        n, 0.0,
        [=] MESHSMOOTH_HD(std::size_t node) {
          u[node] = p[node] = r[node] = {0, 0, 0};
          if (around.fixed[node] != 0) return 0.0;
          r[node] = -1.0F * gradient[node];
          p[node] = preconditioned(node);
          return dot(vec3_cast<double>(r[node]), vec3_cast<double>(p[node]));
        },
        Plus{});
    const double enough = kRough * kRough * now;
    for (int iteration = 0; iteration < kMostIterations && now > enough; ++iteration) {
      executor_.check();
      const double curvature = executor_.reduce(
          n, 0.0,
          [=] MESHSMOOTH_HD(std::size_t node) {
            if (around.fixed[node] != 0) return 0.0;
            ap[node] = allowed_part(around.sliding, node, matrix.row(node, p, SingleThread()));
            return dot(vec3_cast<double>(p[node]), vec3_cast<double>(ap[node]));
          },
          Plus{});
      if (!(curvature > 0)) return;
      const auto alpha = static_cast<float>(now / curvature);
      const double next = executor_.reduce(
          n, 0.0,
          [=] MESHSMOOTH_HD(std::size_t node) {
            if (around.fixed[node] != 0) return 0.0;
            u[node] += alpha * p[node];
            r[node] += -alpha * ap[node];
            return dot(vec3_cast<double>(r[node]), vec3_cast<double>(preconditioned(node)));
          },
          Plus{});
      const auto beta = static_cast<float>(next / now);
      now = next;
      executor_.for_each(n, [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] == 0) p[node] = preconditioned(node) + beta * p[node];
      });
    }
  }

  /// Finds the new direction; returns the energy's slope along it.
  double turn() {
    constexpr double kLeastDescent = 0.1;  // of the slope along the solution alone
    const std::size_t n = node_count();
    const Vec3f* const gradient = data(kGradient);
    const Vec3f* const change = data(kChange);
    const Vec3f* const u = data(kSolution);
    Vec3f* const direction = data(kDirection);
    const bool restarts = restarts_;
    const DirectionProducts products = executor_.reduce(
        n, DirectionProducts{},
        [=] MESHSMOOTH_HD(std::size_t node) {
          const Vec3d g = vec3_cast<double>(gradient[node]);
          const Vec3d solution = vec3_cast<double>(u[node]);
          return DirectionProducts{dot(g, solution), dot(vec3_cast<double>(change[node]), solution),
                                   restarts ? 0.0 : dot(g, vec3_cast<double>(direction[node]))};
        },
        Plus{});
    double beta = restarts ? 0 : std::max(0.0, products.change / last_product_);
    double slope = products.gradient + beta * products.along;
    if (!(slope < kLeastDescent * products.gradient)) {
      beta = 0;
      slope = products.gradient;
    }
    last_product_ = products.gradient;
    restarts_ = false;
    const auto by = static_cast<float>(beta);
    executor_.for_each(n, [=] MESHSMOOTH_HD(std::size_t node) {
      direction[node] = by == 0 ? u[node] : u[node] + by * direction[node];
    });
    return slope;
  }

  /// Puts the free nodes `length` of the direction away from where they were.
  void place(double length) {
    const Surroundings around = sweeper_.around();
    const DisplacementLimit<Real> limit = sweeper_.displacement_limit();
    const Vec3<Real>* const from = from_.data();
    const Vec3f* const direction = data(kDirection);
    const double by = length * rule_.unit;
    Vec3<Real>* const x = sweeper_.positions();
    executor_.for_each(node_count(), [=] MESHSMOOTH_HD(std::size_t node) {
      if (around.fixed[node] != 0) return;
      const Vec3d step = by * vec3_cast<double>(direction[node]);
      x[node] = project(around, limit, node, vec3_cast<Real>(vec3_cast<double>(from[node]) + step));
    });
  }

  /// The energy after a step of this length; infinite where it must not be taken.
  [[nodiscard]] MeshEnergy after(double length) {
    place(length);
    MeshEnergy result = sweeper_.measure(rule_.power);
    if (result.invalid > 0 ||
        turns_facets(executor_, sweeper_.around().sliding, from_.data(), sweeper_.positions())) {
      result.energy = HUGE_VAL;
    }
    return result;
  }

  /// Line search: halves the whole step until the energy falls, then tries the minimum of the
  /// parabola through both values and the slope. False where nothing was better.
  bool search(double slope) {
    constexpr int kHalvings = 8;
    constexpr double kNear = 0.1;  // nothing to gain between lengths that differ by less
    copy_positions<E, Real>(executor_, node_count(), sweeper_.positions(), from_.data());
    double length = 1;
    MeshEnergy best = after(length);
    for (int n = 0; n < kHalvings && !(best.energy < energy_.energy); ++n) {
      length /= 2;
      best = after(length);
    }
    if (!(best.energy < energy_.energy)) {
      copy_positions<E, Real>(executor_, node_count(), from_.data(), sweeper_.positions());
      restarts_ = true;
      return false;
    }
    const double bend = best.energy - energy_.energy - slope * length;
    const double lowest = bend > 0 ? -slope * length * length / (2 * bend) : HUGE_VAL;
    const double other = std::clamp(lowest, length / 4, 2 * length);
    if (std::abs(other - length) > kNear * length) {
      const MeshEnergy there = after(other);
      if (there.energy < best.energy) {
        best = there;
      } else {
        place(length);
      }
    }
    energy_ = best;
    return true;
  }

 private:
  enum Vector { kGradient, kChange, kSolution, kDirection, kResidual, kInner, kProduct, kVectors };

  [[nodiscard]] Vec3f* data(Vector vector) { return vectors_[vector].data(); }

  E& executor_;
  OptimizeSweeper<E, Real>& sweeper_;
  MeshDerivatives rule_;
  MeshEnergy energy_;
  double fall_ = HUGE_VAL;
  bool restarts_ = true;  // with the solution alone
  double last_product_ = 0;
  typename E::template Buffer<float> values_, diagonal_;
  typename E::template Buffer<Vec3<Real>> from_;
  std::array<typename E::template Buffer<Vec3f>, kVectors> vectors_;
};

}  // namespace meshsmooth::detail

#pragma once

#include <cmath>
#include <utility>

#include "smooth/linear/laplace_system.hpp"

namespace meshsmooth::detail {

/// How the conjugate gradients ended.
struct LinearStats {
  int iterations = 0;
  double residual = 0;  // relative
};

/// Two sums over the nodes, by component.
struct PairOfSums {
  Vec3d first{0, 0, 0};
  Vec3d second{0, 0, 0};
  friend MESHSMOOTH_HD PairOfSums operator+(const PairOfSums& a, const PairOfSums& b) {
    return {a.first + b.first, a.second + b.second};
  }
};

/// The product of each component.
MESHSMOOTH_HD inline Vec3d products(Vec3f a, Vec3f b) {
  return {double{a.x} * b.x, double{a.y} * b.y, double{a.z} * b.z};
}
MESHSMOOTH_HD inline Vec3f scaled(Vec3f by, Vec3f a) {
  return {by.x * a.x, by.y * a.y, by.z * a.z};
}
/// 0 where the divisor is.
MESHSMOOTH_HD inline float quotient(double a, double b) {
  return static_cast<float>(b != 0 ? a / b : 0);
}
MESHSMOOTH_HD inline Vec3f quotients(Vec3d a, Vec3d b) {
  return {quotient(a.x, b.x), quotient(a.y, b.y), quotient(a.z, b.z)};
}
[[nodiscard]] MESHSMOOTH_HD inline double total(Vec3d a) { return a.x + a.y + a.z; }
/// Of three systems, or of one that all components belong to.
MESHSMOOTH_HD inline Vec3f quotients(Vec3d a, Vec3d b, bool coupled) {
  if (!coupled) return quotients(a, b);
  const float all = quotient(total(a), total(b));
  return {all, all, all};
}

/// The part of a vector along which a free node may move: all of it unless the node slides.
template <class T>
MESHSMOOTH_HD Vec3<T> allowed_part(const SlidingConstraints& sliding, std::size_t node,
                                   Vec3<T> vector) {
  const NodeConstraint* const constraint = sliding.constraint(node);
  if (constraint == nullptr) return vector;
  const Vec3<T> direction = vec3_cast<T>(constraint->direction);
  const Vec3<T> along = dot(direction, vector) * direction;
  return constraint->along() ? along : vector - along;
}

/// Whether a node slides along a plane or a line that is oblique to the axes: the components are
/// then one system, for which lengths of steps of their own would lead off the planes. O(nodes).
template <Executor E>
bool couples_components(E& executor, const Surroundings& around) {
  if (!around.sliding.any()) return false;
  const std::int64_t oblique = executor.reduce(
      around.node_count, std::int64_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
        const NodeConstraint* const constraint = around.sliding.constraint(node);
        if (constraint == nullptr || around.fixed[node] != 0) return 0;
        const Vec3d d = constraint->direction;
        return (d.x != 0) + (d.y != 0) + (d.z != 0) > 1 ? 1 : 0;
      },
      Plus{});
  return oblique > 0;
}

/// A node's part of the sums over the residual: its squares in `second`. Without a hierarchy it
/// preconditions by the diagonal, too: the products with that in `first`.
struct JacobiSums {
  const float* weights;  // null: there is a hierarchy
  Vec3f* preconditioned;

  /// Stores the residual in `to` unless that is null.
  [[nodiscard]] MESHSMOOTH_HD PairOfSums operator()(std::size_t node, Vec3f residual,
                                                    Vec3f* to) const {
    if (to != nullptr) to[node] = residual;
    if (weights == nullptr) return {{0, 0, 0}, products(residual, residual)};
    const Vec3f z = weights[node] * residual;
    if (to != nullptr) preconditioned[node] = z;
    return {products(residual, z), products(residual, residual)};
  }
};

/// Conjugate gradients on Laplace's equation for a displacement: a system for each component, or
/// one that `couples_components`, preconditioned by a V-cycle, or by the diagonal where there is no
/// hierarchy. Sums stay in executor memory; the host waits once an iteration, for the residual.
template <Executor E>
class LaplaceSolver {
 public:
  LaplaceSolver(E& executor, const Surroundings& around, const LaplaceSystem<E>& system)
      : executor_(executor),
        around_(around),
        system_(system),
        coupled_(couples_components(executor, around)),
        vectors_(executor, around.node_count, system.hierarchy),
        residual_(allocate()),
        preconditioned_(allocate()),
        direction_(allocate()),
        product_(allocate()),
        sums_(executor.template allocate<PairOfSums>(2)),
        curvature_(executor.template allocate<Vec3d>(1)) {}

  /// Continues a displacement into the mesh, until the residual is 1e-4 of that of 0. Less never
  /// left an inverted element that more would not have.
  ///
  /// takes  `u`: the displacement of the fixed nodes, 0 at the others; `guess(u)` may set these and
  ///        returns whether it did
  /// gives  `u` at all nodes; of a sliding node along its plane, line or facets
  /// cost   an iteration: a pass over the rings, two over the nodes, and `cycle`
  /// order  deterministic: the sums are grouped by size alone
  template <class Guess>
  LinearStats solve(Vec3f* u, const Guess& guess) {
    constexpr double kResidual = 1e-4;
    PairOfSums* const now = sums_.data();
    begin(u, now);
    const double first = squares(now);
    LinearStats stats;
    if (!(first > 0)) return stats;
    if (guess(u)) {
      begin(u, now);
      stats.residual = std::sqrt(squares(now) / first);
      if (!(stats.residual > kResidual)) return stats;
      if (stats.residual > 1) {  // the motion was not smooth
        clear_free(u);
        begin(u, now);
      }
    }
    return iterate(u, first, kResidual);
  }

  /// Solves for a given residual, from 0.
  ///
  /// takes  `scale * right`, 0 at fixed nodes and along the constraints at others
  /// gives  `u` at all nodes, 0 at the fixed ones, to `tolerance` of that residual
  LinearStats correct(const Vec3d* right, double scale, double tolerance, Vec3f* u) {
    const JacobiSums sums = jacobi();
    Vec3f* const r = residual_.data();
    executor_.for_each(around_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      u[node] = Vec3f{0, 0, 0};
      r[node] = vec3_cast<float>(scale * right[node]);
    });
    // Apart: GCC 12 sums up squares of what is not yet rounded where it vectorizes both, so that
    // the bits depended on how the loop was inlined, and with that on the number of threads.
    executor_.reduce_to(
        around_.node_count, PairOfSums{},
        [=] MESHSMOOTH_HD(std::size_t node) { return sums(node, r[node], r); }, Plus{},
        sums_.data());
    const double first = squares(sums_.data());
    return first > 0 ? iterate(u, first, tolerance) : LinearStats{};
  }

  /// From the residual and its first sums, to `tolerance` of the one whose squares are `first`.
  LinearStats iterate(Vec3f* u, double first, double tolerance) {
    constexpr int kMostIterations = 5000;
    PairOfSums* now = sums_.data();
    PairOfSums* next = now + 1;
    LinearStats stats;
    while (stats.iterations < kMostIterations) {
      executor_.check();
      precondition(now);
      turn(now, stats.iterations == 0 ? nullptr : next);
      multiply();
      advance(now, u, next);
      ++stats.iterations;
      stats.residual = std::sqrt(squares(next) / first);
      if (!(stats.residual > tolerance)) break;
      std::swap(now, next);
    }
    return stats;
  }

  void clear_free(Vec3f* u) {
    const std::uint8_t* const fixed = around_.fixed;
    executor_.for_each(around_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      if (fixed[node] == 0) u[node] = Vec3f{0, 0, 0};
    });
  }

  /// The residual of `u`, and its squares in `to`; see `JacobiSums`.
  void begin(const Vec3f* u, PairOfSums* to) {
    const Surroundings around = around_;
    const LaplaceMatrix matrix = system_.matrix(around);
    const JacobiSums sums = jacobi();
    Vec3f* const r = residual_.data();
    executor_.template reduce_rows_to<Team>(
        around.node_count, PairOfSums{},
        [=] MESHSMOOTH_HD(std::size_t node, const Team& team) {
          Vec3f value{0, 0, 0};
          if (around.fixed[node] == 0) {
            value = -1.0F * allowed_part(around.sliding, node, matrix.row(node, u, team));
          }
          return sums(node, value, team.rank == 0 ? r : nullptr);
        },
        Plus{}, to);
  }

  /// Preconditions the residual by a V-cycle, and sums up its products with that.
  void precondition(PairOfSums* to) {
    if (system_.hierarchy.empty()) return;
    const Surroundings around = around_;
    const Vec3f* const r = residual_.data();
    Vec3f* const z = preconditioned_.data();
    const JacobiStep last =
        cycle<Team>(executor_, {system_.matrix(around), system_.weights.data(), around.node_count},
                    r, system_.hierarchy, 0, vectors_);
    executor_.template reduce_rows_to<Team>(
        around.node_count, Vec3d{0, 0, 0},
        [=] MESHSMOOTH_HD(std::size_t node, const Team& team) {
          const Vec3f value = allowed_part(around.sliding, node, last(node, team));
          if (team.rank == 0) z[node] = value;
          return products(r[node], value);
        },
        Plus{}, &to->first);
  }

  /// The direction becomes the preconditioned residual, plus a part of itself but at first, where
  /// `before` is null.
  void turn(const PairOfSums* now, const PairOfSums* before) {
    const Vec3f* const z = preconditioned_.data();
    Vec3f* const p = direction_.data();
    const bool coupled = coupled_;
    executor_.for_each(around_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      p[node] = before == nullptr
                    ? z[node]
                    : z[node] + scaled(quotients(now->first, before->first, coupled), p[node]);
    });
  }

  /// The product of the matrix with the direction, and the sums of its products with that.
  void multiply() {
    const Surroundings around = around_;
    const LaplaceMatrix matrix = system_.matrix(around);
    const Vec3f* const p = direction_.data();
    Vec3f* const ap = product_.data();
    executor_.template reduce_rows_to<Team>(
        around.node_count, Vec3d{0, 0, 0},
        [=] MESHSMOOTH_HD(std::size_t node, const Team& team) {
          Vec3f value{0, 0, 0};
          if (around.fixed[node] == 0) {
            value = allowed_part(around.sliding, node, matrix.row(node, p, team));
          }
          if (team.rank == 0) ap[node] = value;
          return products(p[node], value);
        },
        Plus{}, curvature_.data());
  }

  /// A step along the direction, and the squares of the new residual in `to`; see `JacobiSums`.
  void advance(const PairOfSums* now, Vec3f* u, PairOfSums* to) {
    const JacobiSums sums = jacobi();
    const Vec3d* const curvature = curvature_.data();
    const Vec3f* const p = direction_.data();
    const Vec3f* const ap = product_.data();
    Vec3f* const r = residual_.data();
    const bool coupled = coupled_;
    executor_.reduce_to(
        around_.node_count, PairOfSums{},
        [=] MESHSMOOTH_HD(std::size_t node) {
          const Vec3f alpha = quotients(now->first, *curvature, coupled);
          u[node] += scaled(alpha, p[node]);
          return sums(node, r[node] - scaled(alpha, ap[node]), r);
        },
        Plus{}, to);
  }

 private:
  using Team = typename E::RingTeam;

  [[nodiscard]] double squares(const PairOfSums* sums) {
    PairOfSums host;
    executor_.download(sums, 1, &host);
    return total(host.second);
  }
  [[nodiscard]] JacobiSums jacobi() {
    return {system_.hierarchy.empty() ? system_.weights.data() : nullptr, preconditioned_.data()};
  }
  [[nodiscard]] auto allocate() { return executor_.template allocate<Vec3f>(around_.node_count); }

  using Vector = typename E::template Buffer<Vec3f>;
  E& executor_;
  const Surroundings& around_;
  const LaplaceSystem<E>& system_;
  const bool coupled_;
  CycleVectors<E> vectors_;
  Vector residual_, preconditioned_, direction_, product_;
  typename E::template Buffer<PairOfSums> sums_;
  typename E::template Buffer<Vec3d> curvature_;
};

}  // namespace meshsmooth::detail

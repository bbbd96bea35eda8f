#pragma once

#include <cmath>

#include "smooth/motion/laplace_matrix.hpp"

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
[[nodiscard]] inline Vec3f quotients(Vec3d a, Vec3d b) {
  const auto quotient = [](double x, double y) { return static_cast<float>(y != 0 ? x / y : 0); };
  return {quotient(a.x, b.x), quotient(a.y, b.y), quotient(a.z, b.z)};
}
[[nodiscard]] inline double total(Vec3d a) { return a.x + a.y + a.z; }

/// The part of a vector along which a free node may move: all of it unless the node slides.
MESHSMOOTH_HD inline Vec3f allowed_part(const SlidingConstraints& sliding, std::size_t node,
                                        Vec3f vector) {
  const NodeConstraint* const constraint = sliding.constraint(node);
  if (constraint == nullptr) return vector;
  const Vec3f direction = vec3_cast<float>(constraint->direction);
  const Vec3f along = dot(direction, vector) * direction;
  return constraint->along() ? along : vector - along;
}

/// The residual, preconditioned by the diagonal.
struct ByDiagonal {
  const float* diagonal;
  const Vec3f* residual;

  [[nodiscard]] MESHSMOOTH_HD Vec3f operator()(std::size_t node) const {
    return diagonal[node] > 0 ? (1 / diagonal[node]) * residual[node] : Vec3f{0, 0, 0};
  }
  /// Its product with the residual, and the residual's square.
  [[nodiscard]] MESHSMOOTH_HD PairOfSums sums(std::size_t node) const {
    return {products(residual[node], (*this)(node)), products(residual[node], residual[node])};
  }
};

/// Vectors of the conjugate gradients.
template <Executor E>
struct GradientVectors {
  typename E::template Buffer<Vec3f> residual, direction, product;
};

/// Bytes of `solve_laplace`.
[[nodiscard]] inline std::int64_t solving_bytes(const MeshCounts& mesh) {
  return 3 * mesh.nodes * std::int64_t{sizeof(Vec3f)};
}

/// Continues a displacement into the mesh: conjugate gradients on Laplace's equation, a system for
/// each component, preconditioned by the diagonal, until the residual is 1e-4 of the first one.
/// Less never left an inverted element that more would not have.
///
/// takes  `u`: the displacement of the fixed nodes, 0 at the others
/// gives  `u` at all nodes; of a sliding node along its plane, line or facets
/// cost   per iteration a pass over the rings and two over the nodes; `solving_bytes`
/// order  deterministic: the sums are grouped by size alone
template <Executor E>
LinearStats solve_laplace(E& executor, const Surroundings& around, const LaplaceMatrix& matrix,
                          Vec3f* u) {
  constexpr double kResidual = 1e-4;
  constexpr int kMostIterations = 5000;
  const std::size_t n = around.node_count;
  const auto allocate = [&] { return executor.template allocate<Vec3f>(n); };
  GradientVectors<E> vectors{allocate(), allocate(), allocate()};
  Vec3f* const r = vectors.residual.data();
  Vec3f* const p = vectors.direction.data();
  Vec3f* const ap = vectors.product.data();
  const ByDiagonal preconditioned{matrix.diagonal, r};

  PairOfSums now = executor.reduce(
      n, PairOfSums{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const bool free = around.fixed[node] == 0;
        r[node] =
            free ? -1.0F * allowed_part(around.sliding, node, matrix.row(node, u)) : Vec3f{0, 0, 0};
        p[node] = preconditioned(node);
        return preconditioned.sums(node);
      },
      Plus{});
  const double first = total(now.second);
  LinearStats stats;
  if (!(first > 0)) return stats;
  while (stats.iterations < kMostIterations) {
    executor.check();
    const Vec3d curvature = executor.reduce(
        n, Vec3d{0, 0, 0},
        [=] MESHSMOOTH_HD(std::size_t node) {
          if (around.fixed[node] != 0) {
            ap[node] = {0, 0, 0};
            return Vec3d{0, 0, 0};
          }
          ap[node] = allowed_part(around.sliding, node, matrix.row(node, p));
          return products(p[node], ap[node]);
        },
        Plus{});
    const Vec3f alpha = quotients(now.first, curvature);
    const PairOfSums next = executor.reduce(
        n, PairOfSums{},
        [=] MESHSMOOTH_HD(std::size_t node) {
          u[node] += scaled(alpha, p[node]);
          r[node] += scaled(-1.0F * alpha, ap[node]);
          return preconditioned.sums(node);
        },
        Plus{});
    ++stats.iterations;
    stats.residual = std::sqrt(total(next.second) / first);
    if (!(stats.residual > kResidual)) break;
    const Vec3f beta = quotients(next.first, now.first);
    now = next;
    executor.for_each(n, [=] MESHSMOOTH_HD(std::size_t node) {
      p[node] = preconditioned(node) + scaled(beta, p[node]);
    });
  }
  return stats;
}

}  // namespace meshsmooth::detail

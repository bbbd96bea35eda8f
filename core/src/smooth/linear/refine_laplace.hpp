#pragma once

#include <algorithm>
#include <cmath>

#include "smooth/linear/solve_laplace.hpp"

namespace meshsmooth::detail {

/// Bytes of `RefinedSolver`, `LaplaceSolver` and its system.
[[nodiscard]] inline std::int64_t refining_bytes(const MeshCounts& mesh, bool kept) {
  return solving_bytes(mesh, kept) + 2 * mesh.edges * std::int64_t{sizeof(double)} +
         mesh.nodes * static_cast<std::int64_t>(sizeof(Vec3d) + sizeof(Vec3f));
}

/// Laplace's equation for a displacement, solved in double: iterative refinement, whose corrections
/// are those of the conjugate gradients in float. Products with the matrix go by rows, so a matrix
/// that differs from its transpose by roundings alone makes tangents and cotangents transposes of
/// each other to the residual.
///
/// Source: Higham 2002, "Accuracy and stability of numerical algorithms", 12, for mixed precision.
template <Executor E>
class RefinedSolver {
 public:
  /// What it refers to must outlive it. Assembles the matrix once more, in double.
  template <class Real>
  RefinedSolver(E& executor, const Surroundings& around, std::size_t ring_entries,
                const Vec3<Real>* positions, const LaplaceSystem<E>& system)
      : executor_(executor),
        around_(around),
        corrections_(executor, around, system),
        values_(executor.template allocate<double>(ring_entries)),
        residual_(executor.template allocate<Vec3d>(around.node_count)),
        correction_(executor.template allocate<Vec3f>(around.node_count)) {
    assemble_laplace(executor, around, positions, values_.data());
  }

  [[nodiscard]] LaplaceMatrixOf<double> matrix() const { return {around_.rings, values_.data()}; }

  /// Solves until the residual is 1e-13 of the first one, or as small as roundings let it be.
  ///
  /// takes  `right` at the free nodes, null: 0; `x` at the fixed ones, 0 at the others
  /// gives  `x` at all nodes; of a sliding node in its plane or along its line
  /// cost   three to four solutions in float, a product in double for each
  /// order  deterministic
  LinearStats solve(const Vec3d* right, Vec3d* x) {
    constexpr double kResidual = 1e-13;
    constexpr int kMostCorrections = 20;
    const double first = find_residual(right, x);
    LinearStats stats;
    if (!(first > 0)) return stats;
    double now = first;
    for (int n = 0; n < kMostCorrections && now > kResidual * first; ++n) {
      const double tolerance = std::max(kGain, 0.5 * kResidual * first / now);
      stats.iterations += corrections_
                              .correct(residual_.data(), 1 / now, std::min(tolerance, kLeastGain),
                                       correction_.data())
                              .iterations;
      add_correction(now, x);
      const double before = now;
      now = find_residual(right, x);
      if (!(now < kLeastGain * before)) break;
    }
    stats.residual = now / first;
    return stats;
  }

  /// The residual of `x`, and its norm. O(edges).
  double find_residual(const Vec3d* right, const Vec3d* x) {
    const Surroundings around = around_;
    const LaplaceMatrixOf<double> of = matrix();
    Vec3d* const r = residual_.data();
    executor_.template for_each_row<Team>(around.node_count,
                                          [=] MESHSMOOTH_HD(std::size_t node, const Team& team) {
                                            Vec3d value{0, 0, 0};
                                            if (around.fixed[node] == 0) {
                                              value = -1.0 * of.row(node, x, team);
                                              if (right != nullptr) value += right[node];
                                              value = allowed_part(around.sliding, node, value);
                                            }
                                            if (team.rank == 0) r[node] = value;
                                          });
    return std::sqrt(executor_.reduce(
        around.node_count, 0.0,
        [=] MESHSMOOTH_HD(std::size_t node) { return dot(r[node], r[node]); }, Plus{}));
  }

  /// Adds the correction of a residual that was scaled to 1. Directions in float are not the
  /// constraints' own.
  void add_correction(double scale, Vec3d* x) {
    const Surroundings around = around_;
    const Vec3f* const correction = correction_.data();
    executor_.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      if (around.fixed[node] != 0) return;
      x[node] += allowed_part(around.sliding, node, scale * vec3_cast<double>(correction[node]));
    });
  }

 private:
  using Team = typename E::RingTeam;
  static constexpr double kGain = 1e-4;       // of a correction, where more is needed
  static constexpr double kLeastGain = 0.25;  // else roundings are all that is left

  E& executor_;
  const Surroundings& around_;
  LaplaceSolver<E> corrections_;
  typename E::template Buffer<double> values_;
  typename E::template Buffer<Vec3d> residual_;
  typename E::template Buffer<Vec3f> correction_;
};

}  // namespace meshsmooth::detail

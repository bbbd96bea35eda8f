#pragma once

#include <utility>
#include <vector>

#include "smooth/linear/coarse_matrix.hpp"
#include "smooth/linear/dense_inverse.hpp"

namespace meshsmooth::detail {

/// A level of a hierarchy below the finest, and the way to it from the next finer one.
template <Executor E>
struct CoarseLevel {
  std::size_t size = 0;
  Interpolation<E> interpolation;
  CoarseMatrix<E> matrix;
  typename E::template Buffer<float> weights;  // `jacobi_weight`
};

/// Coarser levels of a matrix and the inverse of the last one's. Empty: there are none.
template <Executor E>
struct Hierarchy {
  std::vector<CoarseLevel<E>> levels;
  typename E::template Buffer<float> inverse;  // by rows

  [[nodiscard]] bool empty() const { return levels.empty(); }
};

/// Rows of the coarsest level at most; its inverse is dense.
inline constexpr std::size_t kMostCoarsestRows = 256;

struct EveryRow {
  [[nodiscard]] MESHSMOOTH_HD bool operator()(std::size_t) const { return true; }
};

/// `jacobi_weight` of every row.
template <Executor E, class TakesPart>
void find_weights(E& executor, const LaplaceMatrix& matrix, std::size_t row_count,
                  const TakesPart& takes_part, float* weights) {
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    weights[row] = jacobi_weight(matrix, row, takes_part);
  });
}

/// The next coarser level of a matrix whose rows of weight 0 take no part; of size 0 where it would
/// have more than two thirds as many rows.
template <Executor E>
CoarseLevel<E> find_coarser(E& executor, const LaplaceMatrix& matrix, const float* weights,
                            std::size_t row_count, double threshold) {
  auto diagonal_array = executor.template allocate<float>(row_count);
  float* const diagonal = diagonal_array.data();
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    double sum = 0;
    if (weights[row] > 0) {
      if (matrix.excess != nullptr) sum = matrix.excess[row];
      for (std::int64_t k = matrix.rows.offsets[row]; k < matrix.rows.offsets[row + 1]; ++k) {
        sum -= matrix.values[k];
      }
    }
    diagonal[row] = static_cast<float>(sum);
  });
  const StrongCouplings strong{matrix, diagonal, threshold};
  CoarseLevel<E> level;
  const Aggregates<E> aggregates = find_aggregates(executor, strong, row_count);
  if (aggregates.count * 3 > row_count * 2 || aggregates.count == 0) return level;
  level.size = aggregates.count;
  level.interpolation = find_interpolation(executor, strong, row_count, aggregates);
  level.matrix = coarsen(executor, matrix, level.interpolation, level.size);
  level.weights = executor.template allocate<float>(level.size);
  find_weights(executor, level.matrix.view(), level.size, EveryRow{}, level.weights.data());
  return level;
}

/// Builds a hierarchy by smoothed aggregation; an empty one where the matrix does not coarsen.
///
/// cost   about 40 products with the matrix; 230 B a row while it runs, of which about 110 stay
/// order  deterministic
template <Executor E>
Hierarchy<E> build_hierarchy(E& executor, LaplaceMatrix matrix, const float* weights,
                             std::size_t row_count) {
  Hierarchy<E> hierarchy;
  // Couplings of coarse matrices are more even. Source: see `interpolate`.
  for (double threshold = 0.08; row_count > kMostCoarsestRows;) {
    executor.check();
    CoarseLevel<E> level = find_coarser(executor, matrix, weights, row_count, threshold);
    threshold /= 2;
    if (level.size == 0) {
      if (threshold < 1e-3) return {};
      continue;
    }
    hierarchy.levels.push_back(std::move(level));
    matrix = hierarchy.levels.back().matrix.view();
    weights = hierarchy.levels.back().weights.data();
    row_count = hierarchy.levels.back().size;
  }
  if (hierarchy.empty()) return hierarchy;
  hierarchy.inverse = find_inverse(executor, hierarchy.levels.back().matrix, row_count);
  return hierarchy;
}

/// Vectors of a cycle, by level; of the finest one its guess and another alone.
template <Executor E>
struct CycleVectors {
  using Vector = typename E::template Buffer<Vec3f>;
  struct Level {
    Vector guess, other, right, result;
  };
  std::vector<Level> levels;

  CycleVectors(E& executor, std::size_t row_count, const Hierarchy<E>& hierarchy) {
    if (hierarchy.empty()) return;
    const auto allocate = [&](std::size_t n) { return executor.template allocate<Vec3f>(n); };
    levels.push_back({allocate(row_count), allocate(row_count), {}, {}});
    for (const CoarseLevel<E>& level : hierarchy.levels) {
      const std::size_t n = level.size;
      levels.push_back({allocate(n), allocate(n), allocate(n), allocate(n)});
    }
  }
};

/// A step of damped Jacobi for A x = b: a factor of the polynomial that smooths. The two of
/// these make Chebyshev's polynomial of degree two for eigenvalues in [1/6, 1].
struct JacobiStep {
  LaplaceMatrix matrix;
  const float* weights;
  const Vec3f* right;
  const Vec3f* guess;
  float damping;

  template <class Team>
  [[nodiscard]] MESHSMOOTH_HD Vec3f residual(std::size_t row, const Team& team) const {
    return weights[row] > 0 ? right[row] - matrix.row(row, guess, team) : Vec3f{0, 0, 0};
  }
  template <class Team>
  [[nodiscard]] MESHSMOOTH_HD Vec3f operator()(std::size_t row, const Team& team) const {
    return guess[row] + damping * weights[row] * residual(row, team);
  }
};
inline constexpr float kFirstDamping = 3.4641016F;
inline constexpr float kSecondDamping = 1.1389990F;

/// The matrix of a level, with the weights of damped Jacobi.
struct LevelMatrix {
  LaplaceMatrix matrix;
  const float* weights;
  std::size_t row_count;
};

/// A V-cycle from 0 with two steps of damped Jacobi before and after the coarser level, but for the
/// last step, which is returned. It is a symmetric positive definite operator.
///
/// `Team` shares the rows of this level.
///
/// cost   four products on each level
/// order  deterministic
template <class Team, Executor E>
JacobiStep cycle(E& executor, const LevelMatrix& of, const Vec3f* right,
                 const Hierarchy<E>& hierarchy, std::size_t level, CycleVectors<E>& vectors) {
  const LaplaceMatrix matrix = of.matrix;
  const float* const weights = of.weights;
  const std::size_t row_count = of.row_count;
  using RowTeam = typename E::RowTeam;
  const CoarseLevel<E>& coarser = hierarchy.levels[level];
  Vec3f* const guess = vectors.levels[level].guess.data();
  Vec3f* const other = vectors.levels[level].other.data();
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    other[row] = kFirstDamping * weights[row] * right[row];
  });
  const JacobiStep second{matrix, weights, right, other, kSecondDamping};
  executor.template for_each_row<Team>(row_count,
                                       [=] MESHSMOOTH_HD(std::size_t row, const Team& team) {
                                         const Vec3f x = second(row, team);
                                         if (team.rank == 0) guess[row] = x;
                                       });
  const JacobiStep third{matrix, weights, right, guess, kSecondDamping};
  executor.template for_each_row<Team>(row_count,
                                       [=] MESHSMOOTH_HD(std::size_t row, const Team& team) {
                                         const Vec3f r = third.residual(row, team);
                                         if (team.rank == 0) other[row] = r;
                                       });

  auto& below = vectors.levels[level + 1];
  Vec3f* const below_right = below.right.data();
  Vec3f* const below_result = below.result.data();
  const WeightedRows<ElementId> restriction = coarser.interpolation.restriction();
  executor.template for_each_row<RowTeam>(coarser.size,
                                          [=] MESHSMOOTH_HD(std::size_t row, const RowTeam& team) {
                                            const Vec3f sum = restriction.row(row, other, team);
                                            if (team.rank == 0) below_right[row] = sum;
                                          });
  if (level + 1 == hierarchy.levels.size()) {
    const DenseRows inverse{hierarchy.inverse.data(), coarser.size};
    executor.template for_each_row<RowTeam>(
        coarser.size, [=] MESHSMOOTH_HD(std::size_t row, const RowTeam& team) {
          const Vec3f x = inverse.row(row, below_right, team);
          if (team.rank == 0) below_result[row] = x;
        });
  } else {
    const JacobiStep last =
        cycle<RowTeam>(executor, {coarser.matrix.view(), coarser.weights.data(), coarser.size},
                       below_right, hierarchy, level + 1, vectors);
    executor.template for_each_row<RowTeam>(
        coarser.size, [=] MESHSMOOTH_HD(std::size_t row, const RowTeam& team) {
          const Vec3f x = last(row, team);
          if (team.rank == 0) below_result[row] = x;
        });
  }
  const WeightedRows<NodeId> prolongation = coarser.interpolation.prolongation();
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    guess[row] += prolongation.row(row, below_result, SingleThread());
  });
  executor.template for_each_row<Team>(row_count,
                                       [=] MESHSMOOTH_HD(std::size_t row, const Team& team) {
                                         const Vec3f x = third(row, team);
                                         if (team.rank == 0) other[row] = x;
                                       });
  return {matrix, weights, right, other, kFirstDamping};
}

}  // namespace meshsmooth::detail

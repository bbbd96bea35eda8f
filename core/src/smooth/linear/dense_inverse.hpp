#pragma once

#include <vector>

#include "smooth/linear/coarse_matrix.hpp"

namespace meshsmooth::detail {

/// A dense symmetric matrix in executor memory.
struct DenseRows {
  const float* values;
  std::size_t size;

  template <class Team>
  [[nodiscard]] MESHSMOOTH_HD Vec3f row(std::size_t row, const Vec3f* x, const Team& team) const {
    Vec3f sum{0, 0, 0};
    for (auto k = static_cast<std::size_t>(team.rank); k < size; k += team.size) {
      sum += values[row * size + k] * x[k];
    }
    return team.sum(sum);
  }
};

/// Inverts a symmetric positive definite matrix in place, by Gauss and Jordan. Unknowns that others
/// determine, to the rounding of float, become 0.
inline void invert(std::vector<double>& a, std::size_t n) {
  std::vector<double> first(n), pivot_row(n);
  for (std::size_t k = 0; k < n; ++k) first[k] = a[k * n + k];
  for (std::size_t k = 0; k < n; ++k) {
    double* const row_k = a.data() + k * n;
    const double inverse = row_k[k] > 1e-6 * first[k] ? 1 / row_k[k] : 0;
    row_k[k] = 1;
    for (std::size_t j = 0; j < n; ++j) pivot_row[j] = row_k[j] *= inverse;
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k) continue;
      double* const row = a.data() + i * n;
      const double factor = row[k];
      row[k] = 0;
      for (std::size_t j = 0; j < n; ++j) row[j] -= factor * pivot_row[j];
    }
  }
}

/// The inverse of a matrix, computed on the host.
///
/// cost   O(rows³)
template <Executor E>
typename E::template Buffer<float> find_inverse(E& executor, const CoarseMatrix<E>& matrix,
                                                std::size_t n) {
  std::vector<std::int64_t> offsets(n + 1);
  std::vector<NodeId> columns(matrix.values.size());
  std::vector<float> values(matrix.values.size()), excess(n);
  executor.download(matrix.rows.offsets.data(), n + 1, offsets.data());
  executor.download(matrix.rows.entries.data(), columns.size(), columns.data());
  executor.download(matrix.values.data(), values.size(), values.data());
  executor.download(matrix.excess.data(), n, excess.data());

  std::vector<double> dense(n * n);
  for (std::size_t row = 0; row < n; ++row) {
    double diagonal = excess[row];
    for (auto k = static_cast<std::size_t>(offsets[row]);
         k < static_cast<std::size_t>(offsets[row + 1]); ++k) {
      diagonal -= values[k];
      dense[row * n + static_cast<std::size_t>(columns[k])] = values[k];
    }
    dense[row * n + row] = diagonal;
  }
  invert(dense, n);
  // Symmetric to the last bit, as conjugate gradients need it.
  std::vector<float> inverse(n * n);
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t k = 0; k < n; ++k) {
      inverse[row * n + k] = static_cast<float>((dense[row * n + k] + dense[k * n + row]) / 2);
    }
  }
  auto result = executor.template allocate<float>(n * n);
  executor.upload(inverse.data(), inverse.size(), result.data());
  executor.synchronize();  // the host's array ends here
  return result;
}

}  // namespace meshsmooth::detail

#pragma once

#include "smooth/linear/interpolation.hpp"

namespace meshsmooth::detail {

/// Owns a `LaplaceMatrix` of a coarser level.
template <Executor E>
struct CoarseMatrix {
  RowBuffer<E, NodeId> rows;
  typename E::template Buffer<float> values, excess;

  [[nodiscard]] LaplaceMatrix view() const { return {rows.view(), values.data(), excess.data()}; }
};

/// The product P'AP of Galerkin, by rows.
struct GalerkinProduct {
  LaplaceMatrix matrix;  // A
  Rows<NodeId> rows;     // of P
  const float* values;
  WeightedRows<ElementId> columns;  // of P

  /// Calls `visit(column, value)` for all terms of a row, the diagonal's too, in a fixed order.
  template <class Visit>
  MESHSMOOTH_HD void visit_terms(std::size_t row, const Visit& visit) const {
    const auto visit_row = [&](std::size_t node, double factor) {
      for (std::int64_t k = rows.offsets[node]; k < rows.offsets[node + 1]; ++k) {
        visit(rows.entries[k], factor * values[k]);
      }
    };
    for (std::int64_t c = columns.rows.offsets[row]; c < columns.rows.offsets[row + 1]; ++c) {
      const std::size_t node = columns.rows.entries[c];
      const double weight = columns.values[c];
      double diagonal = matrix.excess == nullptr ? 0 : matrix.excess[node];
      for (std::int64_t k = matrix.rows.offsets[node]; k < matrix.rows.offsets[node + 1]; ++k) {
        const double value = matrix.values[k];
        diagonal -= value;
        visit_row(static_cast<std::size_t>(matrix.rows.entries[k]), weight * value);
      }
      visit_row(node, weight * diagonal);
    }
  }
};

/// A set of ids: open addressing in memory of the caller's, a power of two of slots.
struct IdSet {
  NodeId* slots;  // -1: empty
  std::uint32_t capacity;
  std::uint32_t size = 0;

  [[nodiscard]] MESHSMOOTH_HD bool full() const { return size > capacity / 4 * 3; }
  MESHSMOOTH_HD void insert(NodeId id) {
    if (full()) return;
    std::uint32_t slot = static_cast<std::uint32_t>(id) * 0x9e3779b1U;
    for (slot = (slot ^ (slot >> 16)) % capacity; slots[slot] != id; slot = (slot + 1) % capacity) {
      if (slots[slot] >= 0) continue;
      slots[slot] = id;
      ++size;
      return;
    }
  }
};

/// Finds the columns of a Galerkin product's rows, ascending, without the diagonal.
///
/// cost   a pass over its terms; 512 B a row while it runs, twice as much as long as a row has more
///        columns than that can hold
template <Executor E>
RowBuffer<E, NodeId> find_columns(E& executor, const GalerkinProduct& product,
                                  std::size_t row_count) {
  RowBuffer<E, NodeId> result;
  result.offsets = executor.template allocate<std::int64_t>(row_count + 1);
  std::int64_t* const offsets = result.offsets.data();
  for (std::uint32_t capacity = 128;; capacity *= 2) {
    auto sets = executor.template allocate<NodeId>(row_count * capacity);
    NodeId* const all_slots = sets.data();
    const bool full = executor.reduce(
        row_count + 1, false,
        [=] MESHSMOOTH_HD(std::size_t row) {
          if (row == row_count) {
            offsets[row] = 0;
            return false;
          }
          IdSet set{all_slots + row * capacity, capacity};
          for (std::uint32_t slot = 0; slot < capacity; ++slot) set.slots[slot] = -1;
          product.visit_terms(row, [&](NodeId column, double) {
            if (column != static_cast<NodeId>(row)) set.insert(column);
          });
          offsets[row] = set.size;
          return set.full();
        },
        [] MESHSMOOTH_HD(bool a, bool b) { return a || b; });
    if (full) continue;
    result.entries = executor.template allocate<NodeId>(
        static_cast<std::size_t>(executor.exclusive_scan(offsets, row_count + 1)));
    NodeId* const entries = result.entries.data();
    executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
      std::int64_t place = offsets[row];
      for (std::uint32_t slot = 0; slot < capacity; ++slot) {
        const NodeId column = all_slots[row * capacity + slot];
        if (column >= 0) entries[place++] = column;
      }
      sort_row(entries + offsets[row], static_cast<std::size_t>(place - offsets[row]),
               [](NodeId column) { return column; });
    });
    return result;
  }
}

/// The matrix of the next coarser level, P'AP.
///
/// cost   two passes over the product's terms, about 150 a fine node; see `find_columns`
/// order  deterministic
template <Executor E>
CoarseMatrix<E> coarsen(E& executor, const LaplaceMatrix& matrix,
                        const Interpolation<E>& interpolation, std::size_t row_count) {
  const WeightedRows<NodeId> prolongation = interpolation.prolongation();
  const GalerkinProduct product{matrix, prolongation.rows, prolongation.values,
                                interpolation.restriction()};
  CoarseMatrix<E> result;
  result.rows = find_columns(executor, product, row_count);
  result.values = executor.template allocate<float>(result.rows.entries.size());
  result.excess = executor.template allocate<float>(row_count);
  const Rows<NodeId> rows = result.rows.view();
  float* const values = result.values.data();
  float* const excess = result.excess.data();
  executor.for_each(row_count, [=] MESHSMOOTH_HD(std::size_t row) {
    const std::int64_t begin = rows.offsets[row], end = rows.offsets[row + 1];
    for (std::int64_t k = begin; k < end; ++k) values[k] = 0;
    double sum = 0;
    product.visit_terms(row, [&](NodeId column, double value) {
      sum += value;
      if (column == static_cast<NodeId>(row)) return;
      std::int64_t low = begin, high = end - 1;
      while (low < high) {
        const std::int64_t middle = (low + high) / 2;
        if (rows.entries[middle] < column) {
          low = middle + 1;
        } else {
          high = middle;
        }
      }
      values[low] += static_cast<float>(value);
    });
    excess[row] = static_cast<float>(sum);
  });
  return result;
}

}  // namespace meshsmooth::detail

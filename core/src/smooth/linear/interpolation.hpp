#pragma once

#include "smooth/base/rows.hpp"
#include "smooth/linear/aggregates.hpp"

namespace meshsmooth::detail {

/// Values of a rectangular matrix by rows, in executor memory.
template <class Id>
struct WeightedRows {
  Rows<Id> rows;
  const float* values;

  /// A row times a vector.
  template <class Team>
  [[nodiscard]] MESHSMOOTH_HD Vec3f row(std::size_t row, const Vec3f* x, const Team& team) const {
    Vec3f sum{0, 0, 0};
    const std::int64_t end = rows.offsets[row + 1];
    for (std::int64_t k = rows.offsets[row] + team.rank; k < end; k += team.size) {
      sum += values[k] * x[rows.entries[k]];
    }
    return team.sum(sum);
  }
};

/// From the unknowns of a coarser level to those of a finer one, and its transpose.
template <Executor E>
struct Interpolation {
  RowBuffer<E, NodeId> rows;
  typename E::template Buffer<float> values;
  RowBuffer<E, ElementId> columns;
  typename E::template Buffer<float> column_values;

  [[nodiscard]] WeightedRows<NodeId> prolongation() const { return {rows.view(), values.data()}; }
  [[nodiscard]] WeightedRows<ElementId> restriction() const {
    return {columns.view(), column_values.data()};
  }
};

/// A row of the interpolation: what a node takes of the aggregates around it.
struct InterpolationRow {
  static constexpr int kMost = 32;  // more are left out
  int size = 0;
  NodeId aggregates[kMost];
  double values[kMost];

  MESHSMOOTH_HD void add(NodeId aggregate, double value) {
    int place = 0;
    while (place < size && aggregates[place] != aggregate) ++place;
    if (place == kMost) return;
    if (place == size) {
      aggregates[size] = aggregate;
      values[size++] = 0;
    }
    values[place] += value;
  }
};

/// Smoothed aggregation: 1 on the node's aggregate, after a step of damped Jacobi (2/3) on the
/// matrix of strong couplings, in which weak ones are added to the diagonal. Source: Vanek, Mandel,
/// Brezina 1996, "Algebraic multigrid by smoothed aggregation", 5.1.
MESHSMOOTH_HD inline InterpolationRow interpolate(const StrongCouplings& strong, std::size_t node,
                                                  const NodeId* aggregates) {
  constexpr double kDamping = 2.0 / 3.0;
  InterpolationRow row;
  if (aggregates[node] < 0) return row;
  const LaplaceMatrix& matrix = strong.matrix;
  // The row's sum over the columns that take part, which is kept.
  double outside = matrix.excess == nullptr ? 0 : matrix.excess[node];
  for (std::int64_t k = matrix.rows.offsets[node]; k < matrix.rows.offsets[node + 1]; ++k) {
    const auto column = static_cast<std::size_t>(matrix.rows.entries[k]);
    if (!strong.takes_part(column)) outside -= matrix.values[k];
  }
  double diagonal = outside > 0 ? outside : 0;
  strong.visit(node, [&](NodeId, double strength) { diagonal += strength; });
  row.add(aggregates[node], 1 - kDamping);
  strong.visit(node, [&](NodeId other, double strength) {
    if (aggregates[other] >= 0) row.add(aggregates[other], kDamping * strength / diagonal);
  });
  return row;
}

/// Emits the columns of a row, to `group_items` by column.
struct VisitRow {
  Rows<NodeId> rows;

  template <class Emit>
  MESHSMOOTH_HD void operator()(std::size_t row, const Emit& emit) const {
    for (const NodeId* id = rows.begin(row); id != rows.end(row); ++id) emit(*id);
  }
};

/// cost   three passes over the matrix and a sort of the transpose's rows
/// order  deterministic
template <Executor E>
Interpolation<E> find_interpolation(E& executor, const StrongCouplings& strong,
                                    std::size_t node_count, const Aggregates<E>& aggregates) {
  const NodeId* const of = aggregates.of.data();
  Interpolation<E> result;
  result.rows.offsets = executor.template allocate<std::int64_t>(node_count + 1);
  std::int64_t* const offsets = result.rows.offsets.data();
  executor.for_each(node_count + 1, [=] MESHSMOOTH_HD(std::size_t node) {
    offsets[node] = node < node_count ? interpolate(strong, node, of).size : 0;
  });
  const auto entry_count =
      static_cast<std::size_t>(executor.exclusive_scan(offsets, node_count + 1));
  result.rows.entries = executor.template allocate<NodeId>(entry_count);
  result.values = executor.template allocate<float>(entry_count);
  NodeId* const entries = result.rows.entries.data();
  float* const values = result.values.data();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const InterpolationRow row = interpolate(strong, node, of);
    for (int n = 0; n < row.size; ++n) {
      entries[offsets[node] + n] = row.aggregates[n];
      values[offsets[node] + n] = static_cast<float>(row.values[n]);
    }
  });

  result.columns = group_items(executor, aggregates.count, node_count, VisitRow{result.rows.view()},
                               [] MESHSMOOTH_HD(ElementId node) { return node; });
  result.column_values = executor.template allocate<float>(entry_count);
  float* const column_values = result.column_values.data();
  const Rows<ElementId> columns = result.columns.view();
  executor.for_each(aggregates.count, [=] MESHSMOOTH_HD(std::size_t column) {
    for (std::int64_t c = columns.offsets[column]; c < columns.offsets[column + 1]; ++c) {
      std::int64_t k = offsets[columns.entries[c]];
      while (entries[k] != static_cast<NodeId>(column)) ++k;
      column_values[c] = values[k];
    }
  });
  return result;
}

}  // namespace meshsmooth::detail

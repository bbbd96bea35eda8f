#pragma once

#include <cmath>

#include "smooth/base/executor.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/base/targets.hpp"

namespace meshsmooth::detail {

/// A symmetric matrix by rows, in executor memory: Laplace's on a mesh, whose rows are the rings,
/// or a coarser one. The diagonal is minus the sum of the row's values, plus `excess`.
template <class T>
struct LaplaceMatrixOf {
  Rows<NodeId> rows;
  const T* values;            // by entry
  const T* excess = nullptr;  // by row; null: 0

  /// The row of a node times a vector. By differences: in a thin layer the diagonal's rounding
  /// exceeds what couples the node to its neighbours along the layer.
  template <class Team>
  [[nodiscard]] MESHSMOOTH_HD Vec3<T> row(std::size_t node, const Vec3<T>* x,
                                          const Team& team) const {
    const Vec3<T> own = x[node];
    Vec3<T> sum{0, 0, 0};
    const std::int64_t end = rows.offsets[node + 1];
    for (std::int64_t k = rows.offsets[node] + team.rank; k < end; k += team.size) {
      sum += values[k] * (x[rows.entries[k]] - own);
    }
    sum = team.sum(sum);
    return excess == nullptr ? sum : sum + excess[node] * own;
  }
};
using LaplaceMatrix = LaplaceMatrixOf<float>;

/// The edges of corner `k` of an element, as the corner of a target: the rows of its inverse are
/// the gradients of the shape functions of the corner's neighbours.
template <int kDimension, class Get>
MESHSMOOTH_HD IdealCorner gradients_at(const ElementShape& shape, int k, const Get& get) {
  const CornerShape& corner = shape.corners[k];
  const Vec3d origin = get(corner.node);
  Vec3d edges[kDimension];
  for (int m = 0; m < kDimension; ++m) edges[m] = get(corner.neighbours[m]) - origin;
  return corner_of_edges<kDimension>(edges);
}

template <int kDimension>
MESHSMOOTH_HD double dot_of_gradients(const IdealCorner& corner, int a, int b) {
  double sum = 0;
  for (int c = 0; c < kDimension; ++c) sum += corner.inverse[a][c] * corner.inverse[b][c];
  return sum;
}

/// Calls `add(local node, value)` for what an element contributes to the row of its node `own`:
/// linear finite elements on simplices. On others a corner's determinant times the squared
/// gradients of its neighbours, for each edge: the same where edges meet at right angles, and
/// never of the wrong sign.
template <int kDimension, class Get, class Add>
MESHSMOOTH_HD void add_stiffness(const ElementShape& shape, int own, const Get& get,
                                 const Add& add) {
  if (is_simplex(shape)) {
    const IdealCorner corner = gradients_at<kDimension>(shape, own, get);
    const double volume = corner.determinant / (kDimension == 3 ? 6 : 2);
    for (int m = 0; m < kDimension; ++m) {
      double value = 0;
      for (int n = 0; n < kDimension; ++n) value -= dot_of_gradients<kDimension>(corner, m, n);
      add(shape.corners[own].neighbours[m], volume * value);
    }
    return;
  }
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerShape& at = shape.corners[k];
    bool has_own = at.node == own;
    for (int m = 0; m < kDimension; ++m) has_own = has_own || at.neighbours[m] == own;
    if (!has_own) continue;
    const IdealCorner corner = gradients_at<kDimension>(shape, k, get);
    const double volume = corner.determinant / shape.corner_count;
    for (int m = 0; m < kDimension; ++m) {
      const double value = -volume * dot_of_gradients<kDimension>(corner, m, m);
      if (at.node == own) add(at.neighbours[m], value);
      if (at.neighbours[m] == own) add(at.node, value);
    }
  }
}

/// Calls `add(local node, value)` for what the elements contribute to the row of `node`.
template <int kDimension, class Real, class Add>
MESHSMOOTH_HD void add_element(const Surroundings& around, const Vec3<Real>* positions,
                               std::size_t node, ElementId e, const Add& add) {
  const ElementView element = around.elements[e];
  int own = 0;
  while (own < element.shape->node_count && element.nodes[own] != static_cast<NodeId>(node)) ++own;
  if (own == element.shape->node_count) return;
  add_stiffness<kDimension>(
      *element.shape, own, [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); },
      [&](int n, double value) { add(element.nodes[n], value); });
}

/// The values of a node's row, summed up over its ball in the order of the ball. A hub's row entry
/// by entry, each over the smaller ball of the edge, in the same order: a search of the row for
/// each element would take O(ball * ring).
template <int kDimension, class Real, class Value>
MESHSMOOTH_HD void assemble_row(const Surroundings& around, const Vec3<Real>* positions,
                                std::size_t node, Value* values) {
  constexpr std::size_t kLongRow = 64;
  const NodeId* const ring = around.rings.begin(node);
  const std::size_t ring_size = around.rings.size(node);
  Value* const row = values + around.rings.offsets[node];
  for (std::size_t n = 0; n < ring_size; ++n) row[n] = 0;
  if (ring_size <= kLongRow) {
    for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
      add_element<kDimension>(around, positions, node, *e, [&](NodeId other, double value) {
        std::size_t place = 0;
        while (place < ring_size && ring[place] != other) ++place;
        if (place < ring_size) row[place] += static_cast<Value>(value);
      });
    }
    return;
  }
  for (std::size_t place = 0; place < ring_size; ++place) {
    const auto end = static_cast<std::size_t>(ring[place]);
    const std::size_t from = around.balls.size(end) < around.balls.size(node) ? end : node;
    for (const ElementId* e = around.balls.begin(from); e != around.balls.end(from); ++e) {
      add_element<kDimension>(around, positions, node, *e, [&](NodeId other, double value) {
        if (other == ring[place]) row[place] += static_cast<Value>(value);
      });
    }
  }
}

/// Assembles the values of the matrix of a valid mesh, whose rows are the rings.
///
/// gives  `values`, by ring entry
/// cost   O(ball entries * min(ring, 64)), at hubs O(ring * ball of the neighbours)
/// order  deterministic
template <Executor E, class Real, class Value>
void assemble_laplace(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                      Value* values) {
  if (around.surface()) {
    executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      assemble_row<2>(around, positions, node, values);
    });
  } else {
    executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      assemble_row<3>(around, positions, node, values);
    });
  }
}

/// The inverse of a row's absolute sum: scaled by it, the matrix has eigenvalues in (0, 1]
/// (l1-Jacobi). Source: Baker, Falgout, Kolev, Yang 2011, "Multigrid smoothers for ultraparallel
/// computing", 3. 0 where the row takes no part. Columns for which `takes_part` is false count in
/// the diagonal alone.
template <class TakesPart>
MESHSMOOTH_HD float jacobi_weight(const LaplaceMatrix& matrix, std::size_t row,
                                  const TakesPart& takes_part) {
  if (!takes_part(row)) return 0;
  double sum = matrix.excess == nullptr ? 0 : matrix.excess[row];
  for (std::int64_t k = matrix.rows.offsets[row]; k < matrix.rows.offsets[row + 1]; ++k) {
    const double value = matrix.values[k];
    sum -= value;
    if (takes_part(static_cast<std::size_t>(matrix.rows.entries[k]))) sum += std::abs(value);
  }
  return sum > 0 ? static_cast<float>(1 / sum) : 0;
}

}  // namespace meshsmooth::detail

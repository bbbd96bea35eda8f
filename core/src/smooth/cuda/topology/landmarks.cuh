#pragma once

#include <algorithm>
#include <cmath>

#include "smooth/base/topology.hpp"
#include "smooth/cuda/primitives/executor.cuh"

namespace meshsmooth::detail {

/// Nodes spread over a mesh, with the steps along edges from each of them to every node.
struct Landmarks {
  using Steps = std::uint16_t;
  static constexpr int kCount = 8;
  static constexpr Steps kUnreached = 0xffff;

  NodeId nodes[kCount] = {};
  DeviceBuffer<Steps> steps;  // by landmark and node
};

/// What a step of the breadth-first search reaches from the step before.
struct SearchStep {
  Rows<NodeId> rings;
  Landmarks::Steps* steps;
  Landmarks::Steps step;

  /// 1: reached now.
  __device__ unsigned int operator()(std::size_t node) const {
    if (steps[node] != Landmarks::kUnreached) return 0;
    for (const NodeId* n = rings.begin(node); n != rings.end(node); ++n) {
      if (CudaExecutor::load(steps[*n]) + 1 != step) continue;
      CudaExecutor::store(steps[node], step);
      return 1;
    }
    return 0;
  }
};

/// Counts the steps from a node to all others, a pass over the nodes for each step.
inline void count_steps(CudaExecutor& executor, std::size_t node_count, const Rows<NodeId>& rings,
                        NodeId from, Landmarks::Steps* steps) {
  constexpr Landmarks::Steps kMostSteps = 4096;  // a longer mesh keeps the caller's order beyond
  constexpr int kStepsPerAnswer = 16;
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    steps[node] = node == static_cast<std::size_t>(from) ? 0 : Landmarks::kUnreached;
  });
  SearchStep search{rings, steps, 1};
  for (bool reaching = true; reaching && search.step < kMostSteps; ++search.step) {
    if (search.step % kStepsPerAnswer == 0) {
      reaching = executor.reduce(node_count, 0U, search, Plus{}) != 0;
    } else {
      executor.for_each(node_count, search);
    }
  }
}

struct Highest {
  MESHSMOOTH_HD std::uint64_t operator()(std::uint64_t a, std::uint64_t b) const {
    return a > b ? a : b;
  }
};

/// Of the nodes in elements the one with the most steps, the first of these.
[[nodiscard]] inline NodeId find_farthest(CudaExecutor& executor, std::size_t node_count,
                                          const Rows<NodeId>& rings,
                                          const Landmarks::Steps* steps) {
  const std::uint64_t found = executor.reduce(
      node_count, std::uint64_t{0},
      [=] __device__(std::size_t node) -> std::uint64_t {
        if (rings.size(node) == 0) return 0;
        return (std::uint64_t{steps[node]} + 1) << 32 | (0xffffffffU - node);
      },
      Highest{});
  return found == 0 ? 0 : static_cast<NodeId>(0xffffffffU - (found & 0xffffffffU));
}

/// Each landmark is the node farthest from all earlier ones, the first the one farthest from any.
///
/// takes  rings by the caller's ids
/// cost   O(diameter * nodes); 18 B a node
/// order  deterministic
inline Landmarks find_landmarks(CudaExecutor& executor, std::size_t node_count,
                                const Rows<NodeId>& rings) {
  Landmarks result;
  result.steps =
      executor.allocate<Landmarks::Steps>(node_count * static_cast<std::size_t>(result.kCount));
  auto nearest_array = executor.allocate<Landmarks::Steps>(node_count);
  Landmarks::Steps* const nearest = nearest_array.data();
  executor.clear(nearest, node_count);
  const NodeId any = find_farthest(executor, node_count, rings, nearest);
  count_steps(executor, node_count, rings, any, nearest);
  result.nodes[0] = find_farthest(executor, node_count, rings, nearest);
  for (int k = 0; k < Landmarks::kCount; ++k) {
    if (k > 0) result.nodes[k] = find_farthest(executor, node_count, rings, nearest);
    Landmarks::Steps* const steps = result.steps.data() + static_cast<std::size_t>(k) * node_count;
    count_steps(executor, node_count, rings, result.nodes[k], steps);
    executor.for_each(node_count, [=] __device__(std::size_t node) {
      if (k == 0 || steps[node] < nearest[node]) nearest[node] = steps[node];
    });
  }
  return result;
}

/// Distances between landmarks and, from them, positions of nodes: landmark multidimensional
/// scaling (de Silva, Tenenbaum: Sparse multidimensional scaling using landmark points, 2004).
struct LandmarkScaling {
  static constexpr int kCount = Landmarks::kCount;

  double axes[3][kCount] = {};
  double means[kCount] = {};  // of the squared distances from a landmark
  double unreached = 1;       // stands for the distance where there is no way

  /// By counts of steps between landmarks.
  explicit LandmarkScaling(const Landmarks::Steps (&counts)[kCount][kCount]) {
    for (const auto& row : counts) {
      for (const Landmarks::Steps count : row) {
        if (count != Landmarks::kUnreached) unreached = std::max(unreached, 2.0 * count);
      }
    }
    double matrix[kCount][kCount], mean = 0;
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < kCount; ++j) {
        matrix[i][j] = square_of(counts[i][j]);
        means[i] += matrix[i][j] / kCount;
      }
      mean += means[i] / kCount;
    }
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < kCount; ++j) {
        matrix[i][j] = -0.5 * (matrix[i][j] - means[i] - means[j] + mean);
      }
    }
    const double size = norm_of(matrix);
    for (auto& axis : axes) take_axis(matrix, size, axis);
  }

  [[nodiscard]] MESHSMOOTH_HD double square_of(Landmarks::Steps count) const {
    const double distance = count == Landmarks::kUnreached ? unreached : count;
    return distance * distance;
  }

 private:
  using Matrix = double[kCount][kCount];

  [[nodiscard]] static double norm_of(const Matrix& matrix) {
    double square = 0;
    for (const auto& row : matrix) {
      for (const double value : row) square += value * value;
    }
    return std::sqrt(square);
  }

  /// The eigenvector of the largest eigenvalue, over twice that one's root; the matrix loses it.
  /// Power iterations, shifted so that no negative eigenvalue is larger. 0 where what is left of
  /// the matrix is rounding beside its first `size`: the nodes lie in a plane, or in a row.
  static void take_axis(Matrix& matrix, double size, double (&axis)[kCount]) {
    constexpr int kIterations = 200;
    const double shift = norm_of(matrix);
    if (!(shift > 1e-9 * size)) return;
    for (int k = 0; k < kCount; ++k) axis[k] = 1.0 / (k + 1);
    double eigenvalue = 0;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      double next[kCount], square = 0;
      for (int i = 0; i < kCount; ++i) {
        next[i] = shift * axis[i];
        for (int j = 0; j < kCount; ++j) next[i] += matrix[i][j] * axis[j];
        square += next[i] * next[i];
      }
      const double length = std::sqrt(square);
      for (int k = 0; k < kCount; ++k) axis[k] = next[k] / length;
      eigenvalue = length - shift;
    }
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < kCount; ++j) matrix[i][j] -= eigenvalue * axis[i] * axis[j];
    }
    const double scale = eigenvalue > 1e-6 * size ? 0.5 / std::sqrt(eigenvalue) : 0;
    for (double& value : axis) value *= scale;
  }
};

/// Places nodes by the edges of their mesh alone, so that what is near along edges is near.
///
/// takes  rings by the caller's ids
/// gives  a position for each of the caller's nodes
/// cost   see `find_landmarks`
/// order  deterministic
inline void place_by_edges(CudaExecutor& executor, std::size_t node_count,
                           const Rows<NodeId>& rings, Vec3f* positions) {
  constexpr int kCount = Landmarks::kCount;
  const Landmarks landmarks = find_landmarks(executor, node_count, rings);
  const Landmarks::Steps* const steps = landmarks.steps.data();
  Landmarks::Steps counts[kCount][kCount];
  for (int i = 0; i < kCount; ++i) {
    for (int j = 0; j < kCount; ++j) {
      executor.download_later(steps + static_cast<std::size_t>(i) * node_count + landmarks.nodes[j],
                              &counts[i][j]);
    }
  }
  executor.synchronize();
  const LandmarkScaling scaling(counts);
  executor.for_each(node_count, [=] __device__(std::size_t node) {
    double sums[3] = {0, 0, 0};
    for (int k = 0; k < kCount; ++k) {
      const double square =
          scaling.square_of(steps[static_cast<std::size_t>(k) * node_count + node]);
      for (int axis = 0; axis < 3; ++axis) {
        sums[axis] += scaling.axes[axis][k] * (scaling.means[k] - square);
      }
    }
    positions[node] = {static_cast<float>(sums[0]), static_cast<float>(sums[1]),
                       static_cast<float>(sums[2])};
  });
  executor.synchronize();  // `landmarks` goes
}

}  // namespace meshsmooth::detail

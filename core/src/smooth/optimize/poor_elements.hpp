#pragma once

#include "meshsmooth/summary.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/energy/box_lengths.hpp"

namespace meshsmooth::detail {

/// The counts of `PoorElements`, to be added up.
struct PoorCounts {
  std::int64_t poor = 0;
  std::int64_t locked = 0;
  std::int64_t limited = 0;

  friend MESHSMOOTH_HD PoorCounts operator+(const PoorCounts& a, const PoorCounts& b) {
    return {a.poor + b.poor, a.locked + b.locked, a.limited + b.limited};
  }
};

template <int kDimension, Executor E, class Real>
PoorCounts add_poor(E& executor, const Surroundings& around, double quality, const Vec3<Real>* x,
                    const Vec3<Real>* trial) {
  return executor.reduce(
      around.elements.count, PoorCounts{},
      [=] MESHSMOOTH_HD(std::size_t e) {
        const ElementView element = around.elements[e];
        const double ratio = least_mean_ratio<kDimension>(
            *element.shape, [&](int n) { return vec3_cast<double>(x[element.nodes[n]]); },
            around.reference_of(e),
            [&](int k) { return corner_target<kDimension>(around.targets, e, element, k); });
        if (!(ratio < quality)) return PoorCounts{};
        bool locked = true, moves = false;
        for (int n = 0; n < element.shape->node_count; ++n) {
          const NodeId node = element.nodes[n];
          locked = locked && around.fixed[node] != 0;
          moves = moves || !(x[node] == trial[node]);
        }
        return PoorCounts{1, locked ? 1 : 0, locked || moves ? 0 : 1};
      },
      Plus{});
}

/// The elements whose mean ratio against the target is below `quality`, at the positions `x`. In
/// `trial` every node whose ball could become better lies elsewhere.
///
/// cost   O(elements)
template <Executor E, class Real>
PoorElements count_poor(E& executor, const Surroundings& around, double quality,
                        const Vec3<Real>* x, const Vec3<Real>* trial) {
  const PoorCounts counts = around.surface() ? add_poor<2>(executor, around, quality, x, trial)
                                             : add_poor<3>(executor, around, quality, x, trial);
  return {quality, counts.poor, counts.locked, counts.limited};
}

}  // namespace meshsmooth::detail

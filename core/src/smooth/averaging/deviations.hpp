#pragma once

#include <cmath>

#include "meshsmooth/summary.hpp"
#include "smooth/base/closest_point.hpp"
#include "smooth/base/executor.hpp"

namespace meshsmooth::detail {

/// Measures the nodes with a curved constraint. If a node seems farther off than `tolerance`, all
/// facets are searched.
///
/// cost   O(curved nodes)
template <Executor E, class Real>
BoundaryDeviation measure_deviations(E& executor, std::size_t node_count,
                                     const SlidingConstraints& sliding, double tolerance,
                                     const Vec3<Real>* positions) {
  return executor.reduce(
      node_count, BoundaryDeviation{.tolerance = tolerance},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const NodeConstraint* const constraint = sliding.constraint(node);
        if (constraint == nullptr || !constraint->curved())
          return BoundaryDeviation{.tolerance = tolerance};
        const auto came = [&](NodeId n) { return sliding.home(n); };
        const auto lies = [&](NodeId n) { return vec3_cast<double>(positions[n]); };
        const Vec3d position = lies(static_cast<NodeId>(node));
        const Vec3d home = constraint->home;
        double off = closest_of_constraint(sliding, node, home, position, came).squared;
        for (std::size_t f = 0; off > tolerance * tolerance && f < sliding.facet_count; ++f) {
          const double found = closest_on_facet(sliding.facets[f], position, came).squared;
          if (found < off) off = found;
        }
        return BoundaryDeviation{
            tolerance, std::sqrt(off),
            std::sqrt(closest_of_constraint(sliding, node, position, home, lies).squared)};
      },
      [] MESHSMOOTH_HD(const BoundaryDeviation& a, const BoundaryDeviation& b) {
        return BoundaryDeviation{
            a.tolerance,
            a.result_to_input > b.result_to_input ? a.result_to_input : b.result_to_input,
            a.input_to_result > b.input_to_result ? a.input_to_result : b.input_to_result};
      });
}

}  // namespace meshsmooth::detail

#pragma once

#include <cmath>

#include "smooth/rules/closest_point.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// One-sided (Hausdorff) deviations of the nodes of curved parts, in the mesh's unit.
struct OneSidedDeviations {
  double result_to_input = 0;  // largest distance of a node from the input facets
  double input_to_result = 0;  // largest distance of an input position from the current facets

  friend MESHSMOOTH_HD OneSidedDeviations operator+(const OneSidedDeviations& a,
                                                    const OneSidedDeviations& b) {
    return {a.result_to_input > b.result_to_input ? a.result_to_input : b.result_to_input,
            a.input_to_result > b.input_to_result ? a.input_to_result : b.input_to_result};
  }
};

/// Measures the nodes with a curved constraint. If a node seems farther off than `tolerance`, all
/// facets are searched.
///
/// cost   O(curved nodes)
template <Executor E, class Real>
OneSidedDeviations measure_deviations(E& executor, std::size_t node_count,
                                      const SlidingConstraints& sliding, double tolerance,
                                      const Vec3<Real>* positions) {
  return executor.reduce(
      node_count, OneSidedDeviations{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        const NodeConstraint* const constraint = sliding.constraint(node);
        if (constraint == nullptr || !constraint->curved()) return OneSidedDeviations{};
        const auto came = [&](NodeId n) { return sliding.home(n); };
        const auto lies = [&](NodeId n) { return vec3_cast<double>(positions[n]); };
        const Vec3d position = lies(static_cast<NodeId>(node));
        const Vec3d home = constraint->home;
        double off = closest_of_constraint(sliding, node, home, position, came).squared;
        for (std::size_t f = 0; off > tolerance * tolerance && f < sliding.facet_count; ++f) {
          const double found = closest_on_facet(sliding.facets[f], position, came).squared;
          if (found < off) off = found;
        }
        return OneSidedDeviations{
            std::sqrt(off),
            std::sqrt(closest_of_constraint(sliding, node, position, home, lies).squared)};
      },
      Plus{});
}

}  // namespace meshsmooth::detail

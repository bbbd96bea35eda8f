#pragma once

#include "smooth/energy/mesh_energy.hpp"
#include "smooth/guard/sweep_context.hpp"
#include "smooth/optimize/optimize_visit.hpp"

namespace meshsmooth::detail {

/// State of the optimizer's sweeps of one job: the positions and a `VisitState` per node.
template <Executor E, class Real>
class OptimizeSweeper {
 public:
  OptimizeSweeper(E& executor, const SweepContext<E, Real>& context, Vec3<Real>* positions)
      : executor_(executor),
        context_(context),
        states_(executor.template allocate<std::uint8_t>(context.around.node_count)),
        positions_(positions) {}

  /// Before the first sweep of a phase.
  void wake_all() {
    std::uint8_t* const states = states_.data();
    executor_.for_each(around().node_count,
                       [=] MESHSMOOTH_HD(std::size_t node) { states[node] = kAwake; });
  }

  [[nodiscard]] MeshEnergy measure(int power) {
    MeshEnergy result = measure_energy(executor_, around(), positions_, power);
    if (const Anchor* const anchors = around().anchors; anchors != nullptr) {
      const Vec3<Real>* const positions = positions_;
      result.energy += executor_.reduce(
          around().node_count, 0.0,
          [=] MESHSMOOTH_HD(std::size_t node) {
            return anchors[node].energy(vec3_cast<double>(positions[node]));
          },
          Plus{});
    }
    return result;
  }

  [[nodiscard]] bool surface() const { return around().surface(); }
  [[nodiscard]] const Surroundings& around() const { return context_.around; }
  [[nodiscard]] const Colouring<E>& colouring() const { return *context_.colouring; }
  [[nodiscard]] DisplacementLimit<Real> displacement_limit() const {
    return context_.displacement_limit;
  }
  [[nodiscard]] std::uint8_t* states() { return states_.data(); }
  [[nodiscard]] Vec3<Real>* positions() { return positions_; }

 private:
  E& executor_;
  SweepContext<E, Real> context_;
  typename E::template Buffer<std::uint8_t> states_;
  Vec3<Real>* positions_;
};

}  // namespace meshsmooth::detail

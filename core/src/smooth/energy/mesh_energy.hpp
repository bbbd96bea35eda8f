#pragma once

#include <cmath>
#include <limits>

#include "mesh/jacobian.hpp"
#include "meshsmooth/methods.hpp"
#include "smooth/base/convergence.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/energy/ball_energy.hpp"

namespace meshsmooth::detail {

/// Sum over the corners that can change.
struct MeshEnergy {
  double energy = 0;  // weighted sum of f^power
  double weight = 0;
  double worst = 2;  // mean ratio
  std::int64_t invalid = 0;

  friend MESHSMOOTH_HD MeshEnergy operator+(const MeshEnergy& a, const MeshEnergy& b) {
    return {a.energy + b.energy, a.weight + b.weight, a.worst < b.worst ? a.worst : b.worst,
            a.invalid + b.invalid};
  }
};

/// Invalid elements of a mean ratio above minus this have no volume rather than a negative one.
inline constexpr double kFlatMeanRatio = 1e-6;

template <int kDimension>
MESHSMOOTH_HD MeshEnergy energy_of(const CornerTerm& term, int power, double certainty) {
  const double volume = std::abs(term.volume);
  if (!(volume > 0)) return {0, term.weight, 0, 1};
  const CornerEnergy<kDimension> corner(volume, term.size, certainty);
  const double f = corner.stretch / kDimension;
  if (term.volume > 0 && corner.positive)
    return {term.weight * raise(f, power), term.weight, 1 / f, 0};
  return {0, term.weight, term.volume < 0 ? -1 / f : 1 / f, 1};
}

/// Sums over the corners with a free node; one corner stands for a simplex. Elements that are
/// `kSimplices` need no more than their corners.
/// cost   O(elements)
template <int kDimension, bool kSimplices, Executor E, class Real>
MeshEnergy measure_energy(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                          int power) {
  return executor.reduce(
      around.elements.count, MeshEnergy{},
      [=] MESHSMOOTH_HD(std::size_t e) {
        const ElementView element = around.elements[e];
        const ElementShape& shape = *element.shape;
        const auto is_free = [&](int n) { return around.fixed[element.nodes[n]] == 0; };
        const auto get = [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); };
        MeshEnergy sum;
        const bool simplex = is_simplex(shape);
        for (int k = 0; k < (simplex ? 1 : shape.corner_count); ++k) {
          const CornerShape& corner = shape.corners[k];
          bool counts = is_free(corner.node);
          for (int m = 0; m < kDimension; ++m) counts = counts || is_free(corner.neighbours[m]);
          if (!counts) continue;
          const Vec3d origin = get(corner.node);
          const auto relative = [&](int n) { return get(n) - origin; };
          const IdealCorner target = corner_target<kDimension>(around.targets, e, element, k);
          sum = sum + energy_of<kDimension>(corner_term<kDimension>(shape, k, -1, relative, target,
                                                                    around.reference_of(e)),
                                            power, around.targets.certainty);
        }
        // An element with a free node, valid at its corners.
        if (!kSimplices && sum.weight > 0 && sum.invalid == 0 &&
            jacobian_sign(shape, get) != JacobianSign::positive) {
          sum.invalid = 1;
        }
        return sum;
      },
      Plus{});
}

template <Executor E, class Real>
MeshEnergy measure_energy(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                          int power) {
  // In a surface the corners tell; opposite nodes are those of tetrahedra.
  if (around.surface()) return measure_energy<2, true>(executor, around, positions, power);
  return around.opposite != nullptr ? measure_energy<3, true>(executor, around, positions, power)
                                    : measure_energy<3, false>(executor, around, positions, power);
}

/// See `Convergence::energies`.
[[nodiscard]] inline double mean_energy(const MeshEnergy& energy, int power) {
  if (energy.invalid > 0) return std::numeric_limits<double>::infinity();
  return std::pow(energy.energy / energy.weight, 1.0 / power);
}

/// The power that a goal's descent begins with; `worst` goes on from the optimum of `balanced`.
[[nodiscard]] inline int power_of(Goal goal) { return goal == Goal::average ? 1 : 2; }

/// Adds the energy of the mesh to the history, for methods without an energy of their own.
template <Executor E, class Real>
void record_energy(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                   ConvergenceMonitor& monitor) {
  const int power = power_of(Goal::balanced);
  const MeshEnergy energy = measure_energy(executor, around, positions, power);
  monitor.record_energy(mean_energy(energy, power), energy.worst);
}

}  // namespace meshsmooth::detail

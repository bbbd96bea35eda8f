#pragma once

#include "smooth/rules/acceptance.hpp"
#include "smooth/steps/colouring.hpp"

namespace meshsmooth::detail {

/// What all sweeps of a job share. Functors capture it by value; `colouring` is for the host.
template <Executor E, class Real>
struct SweepContext {
  Surroundings around;
  const Colouring<E>* colouring = nullptr;  // of the deterministic in-place form
  Acceptance acceptance{};
  DisplacementLimit<Real> displacement_limit{};
};

}  // namespace meshsmooth::detail

#pragma once

#include <array>
#include <concepts>
#include <tuple>

#include "smooth/averaging/means.hpp"
#include "smooth/averaging/sweeper.hpp"

namespace meshsmooth::detail {

/// The sweeps of a backend for one coordinate type and one mean; see `AveragingBackend`.
template <class B, class Real, class Mean>
concept SweepsWith = requires(B& backend, Sweeper<typename B::Executor, Real>& sweeper,
                              const Mean& mean, ConvergenceMonitor& monitor) {
  { backend.sweep(sweeper, mean, 1.0, monitor) } -> std::same_as<void>;
};

/// Whether a backend sweeps with each of some means.
template <class B, class Real, class Means>
inline constexpr bool kSweepsWithEach = false;
template <class B, class Real, class... Mean>
inline constexpr bool kSweepsWithEach<B, Real, std::tuple<Mean...>> = (SweepsWith<B, Real, Mean> &&
                                                                       ...);

/// What the Laplacian methods need of a backend, for one coordinate type.
///
///   sweep(sweeper, mean, factor, monitor)
///                         sweeps of a Laplacian method until the monitor reports the end; the
///                         same bits as `run_sweeps_one_by_one`
///   sweep_steps(sweeper, steps, monitor)
///                         the same for sweeps of one or two steps of Jacobi form; the same bits
///                         as `run_steps_one_by_one`
template <class B, class Real>
concept AveragingBackend =
    requires(B& backend, Sweeper<typename B::Executor, Real>& jacobi,
             const std::array<LaplacianStep<UniformMean, Real>, 2>& two_steps,
             const std::array<HcStep<Real>, 1>& one_step, ConvergenceMonitor& monitor) {
  { backend.sweep_steps(jacobi, two_steps, monitor) } -> std::same_as<void>;
  { backend.sweep_steps(jacobi, one_step, monitor) } -> std::same_as<void>;
}
&&kSweepsWithEach<B, Real, Means>;

}  // namespace meshsmooth::detail

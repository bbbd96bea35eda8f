#pragma once

#include <array>
#include <utility>

#include "smooth/averaging/sweeps.hpp"
#include "smooth/energy/mesh_energy.hpp"

namespace meshsmooth::detail {

/// Runs sweeps of a Laplacian method in the requested form. Owns the second array of positions
/// that Jacobi and guarded asynchronous sweeps need; `current()` is where the positions are.
template <Executor E, class Real>
class Sweeper {
 public:
  Sweeper(E& executor, const SweepContext<E, Real>& context, Form form, Vec3<Real>* positions)
      : executor_(executor), context_(context), form_(form), current_(positions) {
    context_.suspects = &suspects_;
  }
  Sweeper(const Sweeper&) = delete;
  Sweeper& operator=(const Sweeper&) = delete;

  template <class Mean>
  SweepStats step(const Mean& mean, double factor) {
    const auto f = static_cast<Real>(factor);
    if (form_ == Form::gauss_seidel) {
      return sweep_gauss_seidel(executor_, context_, mean, f, current_);
    }
    if (form_ == Form::asynchronous) {
      if (acceptance().active()) need_spare();
      return sweep_asynchronous(executor_, context_, mean, f, spare_, current_);
    }
    return step(LaplacianStep<Mean, Real>{mean, f});
  }
  /// In Jacobi form, whatever the requested one.
  template <class Step>
  SweepStats step(const Step& jacobi_step) {
    need_spare();
    const SweepStats stats = sweep_jacobi(executor_, context_, jacobi_step, current_, spare_);
    swap();
    return stats;
  }

  /// Reports the sweep just done to the monitor, for a history also the mesh's energy; true
  /// when it was the last.
  bool done(const SweepStats& stats, ConvergenceMonitor& monitor) {
    if (monitor.keeps_history()) record_energy(executor_, around(), current_, monitor);
    return monitor.done(stats);
  }

  void copy(const Vec3<Real>* from, Vec3<Real>* to) {
    copy_positions(executor_, around().node_count, from, to);
  }

  [[nodiscard]] Vec3<Real>* current() { return current_; }
  /// As `current()` on fixed nodes.
  [[nodiscard]] Vec3<Real>* spare() {
    need_spare();
    return spare_;
  }
  void swap() { std::swap(current_, spare_); }

  [[nodiscard]] const Surroundings& around() const { return context_.around; }
  [[nodiscard]] const Colouring<E>& colouring() const { return *context_.colouring; }
  [[nodiscard]] Form form() const { return form_; }
  [[nodiscard]] Acceptance acceptance() const { return context_.acceptance; }
  /// Whether some nodes have a constraint or a displacement limit.
  [[nodiscard]] bool limited() const {
    return context_.displacement_limit.home != nullptr || around().sliding.any();
  }

 private:
  void need_spare() {
    if (spare_ != nullptr) return;
    other_ = executor_.template allocate<Vec3<Real>>(around().node_count);
    spare_ = other_.data();
    copy(current_, spare_);
  }

  E& executor_;
  SweepContext<E, Real> context_;
  Form form_;
  Vec3<Real>* current_;
  Vec3<Real>* spare_ = nullptr;
  typename E::template Buffer<Vec3<Real>> other_;
  typename E::Suspects suspects_;
};

/// Single sweeps until the monitor reports the end.
template <Executor E, class Real, class Mean>
void run_sweeps_one_by_one(Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                           ConvergenceMonitor& monitor) {
  while (!sweeper.done(sweeper.step(mean, factor), monitor)) {
  }
}

/// Single sweeps of several steps each, `take(n)` being the n-th, until the monitor reports the
/// end.
template <Executor E, class Real, class Take>
void run_steps_one_by_one(E& executor, Sweeper<E, Real>& sweeper, std::size_t step_count,
                          const Take& take, ConvergenceMonitor& monitor) {
  if (step_count == 1) {
    while (!sweeper.done(take(0), monitor)) {
    }
    return;
  }
  const std::size_t node_count = sweeper.around().node_count;
  auto start = executor.template allocate<Vec3<Real>>(node_count);
  SweepStats stats;
  do {
    sweeper.copy(sweeper.current(), start.data());
    std::int64_t held = 0;
    for (std::size_t n = 0; n < step_count; ++n) held += take(n).held;
    stats = measure_moves(executor, node_count, start.data(), sweeper.current());
    stats.held = held;
  } while (!sweeper.done(stats, monitor));
}
/// The same for steps of Jacobi form.
template <Executor E, class Real, class Step, std::size_t kSteps>
void run_steps_one_by_one(E& executor, Sweeper<E, Real>& sweeper,
                          const std::array<Step, kSteps>& steps, ConvergenceMonitor& monitor) {
  run_steps_one_by_one(
      executor, sweeper, kSteps, [&](std::size_t n) { return sweeper.step(steps[n]); }, monitor);
}

}  // namespace meshsmooth::detail

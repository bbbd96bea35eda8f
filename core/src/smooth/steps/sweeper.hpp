#pragma once

#include <utility>

#include "smooth/steps/mesh_energy.hpp"
#include "smooth/steps/sweeps.hpp"

namespace meshsmooth::detail {

/// Runs sweeps of a Laplacian method in the requested form. Owns the second array of positions
/// that Jacobi and guarded asynchronous sweeps need; `current()` is where the positions are.
template <Executor E, class Real>
class Sweeper {
 public:
  Sweeper(E& executor, const SweepContext<E, Real>& context, Form form, Vec3<Real>* positions)
      : executor_(executor), context_(context), form_(form), current_(positions) {}

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
    need_spare();
    const SweepStats stats = sweep_jacobi(executor_, context_, mean, f, current_, spare_);
    std::swap(current_, spare_);
    return stats;
  }

  SweepStats step_hc(const HcLaplacian& hc, const Vec3<Real>* original, Vec3<Real>* differences) {
    need_spare();
    const SweepStats stats =
        sweep_hc(executor_, context_, static_cast<Real>(hc.alpha), static_cast<Real>(hc.beta),
                 HcArrays<Real>{original, current_, spare_, differences});
    std::swap(current_, spare_);
    return stats;
  }

  /// Reports the sweep just done to the monitor, for a history also the mesh's energy; true
  /// when it was the last.
  bool done(const SweepStats& stats, ConvergenceMonitor& monitor) {
    if (monitor.options().history) record_energy(executor_, around(), current_, monitor);
    return monitor.done(stats);
  }

  void copy(const Vec3<Real>* from, Vec3<Real>* to) {
    copy_positions(executor_, around().node_count, from, to);
  }

  [[nodiscard]] Vec3<Real>* current() { return current_; }

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
};

/// Single sweeps until the monitor reports the end.
template <Executor E, class Real, class Mean>
void run_sweeps_one_by_one(Sweeper<E, Real>& sweeper, const Mean& mean, double factor,
                           ConvergenceMonitor& monitor) {
  while (!sweeper.done(sweeper.step(mean, factor), monitor)) {
  }
}

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "smooth/base/element_quality.hpp"
#include "smooth/linear/kept_reference.hpp"
#include "smooth/linear/solve_laplace.hpp"
#include "smooth/linear/solving_backend.hpp"
#include "smooth/move/prescribed.hpp"
#include "smooth/optimize/optimize.hpp"

namespace meshsmooth::detail {

/// Whether the Jacobian of an element is certainly positive.
template <class Real>
MESHSMOOTH_HD bool is_valid_element(const Surroundings& around, const Vec3<Real>* positions,
                                    std::size_t e) {
  const ElementView element = around.elements[e];
  return element_quality(
             *element.shape, [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); },
             around.reference_of(e)) > 0;
}

/// Elements that are not valid, and those of them that no sweep can change.
struct InvalidCounts {
  std::int64_t all = 0;
  std::int64_t locked = 0;
  friend MESHSMOOTH_HD InvalidCounts operator+(const InvalidCounts& a, const InvalidCounts& b) {
    return {a.all + b.all, a.locked + b.locked};
  }
};

/// cost   O(elements)
template <Executor E, class Real>
InvalidCounts count_invalid(E& executor, const Surroundings& around, const Vec3<Real>* positions) {
  return executor.reduce(
      around.elements.count, InvalidCounts{},
      [=] MESHSMOOTH_HD(std::size_t e) {
        if (is_valid_element(around, positions, e)) return InvalidCounts{};
        const ElementView element = around.elements[e];
        bool locked = true;
        for (int n = 0; n < element.shape->node_count; ++n) {
          locked = locked && around.fixed[element.nodes[n]] != 0;
        }
        return InvalidCounts{1, locked ? 1 : 0};
      },
      Plus{});
}

/// The caller's ids of the first invalid elements, ascending. O(elements), 1 B an element.
template <Executor E, class Real>
std::vector<std::int64_t> find_invalid(E& executor, const Surroundings& around,
                                       const ElementId* caller_ids, const Vec3<Real>* positions) {
  const std::size_t count = around.elements.count;
  auto flags = executor.template allocate<std::uint8_t>(count);
  std::uint8_t* const invalid = flags.data();
  executor.for_each(count, [=] MESHSMOOTH_HD(std::size_t e) {
    const std::size_t id = caller_ids == nullptr ? e : caller_ids[e];
    invalid[id] = is_valid_element(around, positions, e) ? 0 : 1;
  });
  std::vector<std::uint8_t> found(count);
  executor.download(flags.data(), count, found.data());
  std::vector<std::int64_t> ids;
  for (std::size_t id = 0; id < count && ids.size() < kMostBlockingElements; ++id) {
    if (found[id] != 0) ids.push_back(static_cast<std::int64_t>(id));
  }
  return ids;
}

/// The displacement of the prescribed nodes, 0 at the others.
template <Executor E, class Real>
void begin_displacement(E& executor, std::size_t node_count, const Prescribed<E, Real>& prescribed,
                        Vec3f* displacement) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    displacement[node] = Vec3f{0, 0, 0};
  });
  const NodeId* const nodes = prescribed.nodes.data();
  const Vec3<Real>* const from = prescribed.from.data();
  const Vec3<Real>* const to = prescribed.to.data();
  executor.for_each(prescribed.count, [=] MESHSMOOTH_HD(std::size_t n) {
    displacement[nodes[n]] = vec3_cast<float>(to[n] - from[n]);
  });
}

/// How far nodes go: free ones by `step` of their displacement, prescribed ones to `share` of
/// their whole way.
struct Advance {
  double step;
  double share;
};

/// Places the nodes for a part of the motion, the free ones from `start`.
template <Executor E, class Real>
void place(E& executor, const SweepContext<E, Real>& context, const Prescribed<E, Real>& prescribed,
           const Vec3f* displacement, const Vec3<Real>* start, Advance advance,
           Vec3<Real>* positions) {
  const double share = advance.share;
  const Surroundings around = context.around;
  const DisplacementLimit<Real> limit = context.displacement_limit;
  const auto by = static_cast<Real>(advance.step);
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (around.fixed[node] != 0) return;
    positions[node] =
        project(around, limit, node, start[node] + by * vec3_cast<Real>(displacement[node]));
  });
  const NodeId* const nodes = prescribed.nodes.data();
  const Vec3<Real>* const from = prescribed.from.data();
  const Vec3<Real>* const to = prescribed.to.data();
  const auto whole = static_cast<Real>(share);
  executor.for_each(prescribed.count, [=] MESHSMOOTH_HD(std::size_t n) {
    positions[nodes[n]] = share >= 1 ? to[n] : from[n] + whole * (to[n] - from[n]);
  });
}

/// Bytes of `Motion`, whose sweeps take `sweeping`: at first the solver's; then those of sweeps, or
/// of global steps in place of their acceleration, and where to return to. `kept`: its system is to
/// be kept.
[[nodiscard]] inline std::int64_t motion_bytes(const MeshCounts& mesh, const JobPlan& plan,
                                               bool kept, std::int64_t sweeping) {
  const std::int64_t displacement = mesh.nodes * std::int64_t{sizeof(Vec3f)};
  const std::int64_t prescribed = mesh.nodes * (4 + 2 * mesh.position_bytes);
  const std::int64_t finding = mesh.nodes * (4 + 4 + mesh.position_bytes);
  const std::int64_t valid = mesh.nodes * mesh.position_bytes;
  const int sweeps = plan.iteration_limit;
  const std::int64_t steps = sweeps > kSweepsBeforeSteps ? global_steps_bytes(mesh) : 0;
  const std::int64_t accelerating = sweeps > kDescentSweeps ? anderson_bytes(mesh) : 0;
  const std::int64_t most =
      std::max({mesh.elements, sweeping + std::max(std::int64_t{0}, steps - accelerating),
                optimizer_bytes(mesh) + solving_bytes(mesh, false)});
  return displacement + prescribed + std::max({finding, solving_bytes(mesh, kept), valid + most});
}

/// What a motion is to do, and its statistics to fill.
struct MotionTask {
  const PrescribedNodes& prescribed;
  MotionStats& stats;
};

/// The method Move: from the reference, which is valid, to the prescribed positions, in one step or
/// in halves of it.
template <OptimizingBackend B, class Real>
requires SolvingBackend<B>
class Motion {
 public:
  using E = typename B::Executor;

  /// The job's positions are those of the reference, and become those of the result.
  Motion(B& backend, const SweepContext<E, Real>& context, Colouring<E>& colouring,
         const Move& method, ConvergenceMonitor& monitor, JobMesh<E, Real>& job)
      : backend_(backend),
        executor_(backend.executor()),
        context_(context),
        colouring_(colouring),
        job_(job),
        plan_(monitor.plan()),
        method_(method),
        monitor_(monitor),
        positions_(job.positions.data()) {}

  void run(const MotionTask& task) {
    MotionStats& stats = task.stats;
    const auto prescribed = find_prescribed(executor_, job_, task.prescribed);
    auto displacement = find_displacement(prescribed, stats);
    const std::size_t n = job_.node_count;
    auto valid = executor_.template allocate<Vec3<Real>>(n);  // the last one
    copy_positions<E, Real>(executor_, n, positions_, valid.data());
    const bool sweeps = !monitor_.done_at_once();
    double reached = 0;
    double solved = 0;  // where the displacement was continued
    bool settled = true;
    bool softens = false;
    for (double step = 1; reached < 1 && !job_ended();) {
      const double next = std::min(1.0, reached + step);
      if (solved < reached) {
        continue_displacement(prescribed, valid.data(), displacement.data(), stats);
        solved = reached;
      }
      place(executor_, context_, prescribed, displacement.data(), valid.data(),
            {.step = next - reached, .share = next}, positions_);
      InvalidCounts invalid = count_invalid(executor_, context_.around, positions_);
      const bool tangled = invalid.all > 0;
      if (invalid.all == 0 && near_reference()) {
        if (sweeps) monitor_.end(StopReason::converged, EndRule::small_gains);
      } else if (sweeps && invalid.locked == 0) {
        optimizer().run({.tolerance = next < 1 ? kCoarse : 1,
                         .repairs = kRepairs,
                         .softens = softens,
                         .ring_entries = job_.rings.entries.size(),
                         .precise = false,
                         .raises = next == 1});
        invalid = count_invalid(executor_, context_.around, positions_);
      }
      const bool may_halve = !job_ended() && (next - reached) / 2 >= method_.least_step;
      if (invalid.all == 0 && !(tangled && may_halve && folds(valid.data()))) {
        ++stats.step_count;
        reached = next;
        settled = next == 1;
        copy_positions<E, Real>(executor_, n, positions_, valid.data());
        continue;
      }
      ++stats.rejected_step_count;
      stats.blocking_element_count = invalid.all;
      step = (next - reached) / 2;
      if (step >= method_.least_step) continue;
      if (softens) break;
      softens = true;
      step = 1 - reached;
    }
    stats.reached = reached;
    if (reached == 1) {
      stats.blocking_element_count = 0;
    } else {
      stats.blocking_elements =
          find_invalid(executor_, context_.around, caller_elements(), positions_);
      copy_positions<E, Real>(executor_, n, valid.data(), positions_);
      if (sweeps && !settled && !job_ended()) {
        optimizer().run(
            {.ring_entries = job_.rings.entries.size(), .precise = false, .raises = true});
      }
      if (!job_ended() && (sweeps || monitor_.free_count() == 0)) {
        monitor_.end(StopReason::stagnated, EndRule::no_progress);
      }
    }
    if (plan_.options.report_below) optimizer().report();
  }

 private:
  /// Made when it is first needed: a small step makes no sweep.
  [[nodiscard]] Optimizer<B, Real>& optimizer() {
    if (!optimizer_) {
      colouring_ = backend_.colour(context_.around, job_.caller_ids.data());
      optimizer_.emplace(backend_, context_, plan_.optimizer.value(), monitor_, positions_);
    }
    return *optimizer_;
  }
  [[nodiscard]] bool job_ended() const { return optimizer_ && optimizer_->job_ended(); }

  /// How much more than at the end a sweep must gain to go on, where the motion goes on.
  static constexpr double kCoarse = 100;
  /// If untangling needs more sweeps, halving the step is faster.
  static constexpr int kRepairs = 100;
  /// Times the tolerance: how much worse than in the reference an element may be without a sweep.
  static constexpr double kNear = 200;

  /// Whether every element that can change is nearly as in the reference. Its mean ratio against
  /// that is at most 1: sweeps could not raise the worst one by more than what is missing.
  [[nodiscard]] bool near_reference() {
    const Tolerance& tolerance = plan_.options.tolerance;
    if (context_.around.targets.reference == nullptr || !tolerance.relative) return false;
    const Vec3<Real>* const positions = positions_;
    return measure_energy(executor_, context_.around, positions, 1).worst >=
           1 - kNear * tolerance.value;
  }

  /// Whether untangling has left an element much worse than any was in the last valid mesh: a fold
  /// that the sweeps have drawn apart, but not undone, and that shorter steps do not make.
  [[nodiscard]] bool folds(const Vec3<Real>* valid) {
    constexpr double kFold = 0.1;
    const auto worst = [&](const Vec3<Real>* positions) {
      return measure_energy(executor_, context_.around, positions, 1).worst;
    };
    return worst(positions_) < kFold * worst(valid);
  }

  /// Null: in the caller's order.
  [[nodiscard]] const ElementId* caller_elements() const {
    return job_.elements.caller_ids.size() == 0 ? nullptr : job_.elements.caller_ids.data();
  }

  /// By node; that of the prescribed ones continued into the mesh.
  [[nodiscard]] auto find_displacement(const Prescribed<E, Real>& prescribed, MotionStats& stats) {
    const typename E::Timer timer(executor_, stats.linear_seconds);
    auto displacement = executor_.template allocate<Vec3f>(job_.node_count);
    begin_displacement(executor_, job_.node_count, prescribed, displacement.data());
    const auto shared = find_system(backend_, context_.around, job_.rings.entries.size(),
                                    static_cast<const Vec3<Real>*>(positions_));
    LaplaceSolver<E> solver(executor_, context_.around, shared->system);
    auto* const kept = method_.start == Start::warm ? backend_.kept_reference() : nullptr;
    const LinearStats linear = solver.solve(displacement.data(), [&](Vec3f* u) {
      return kept != nullptr && kept->extrapolate(executor_, context_.around, shared.get(), u);
    });
    if (kept != nullptr) {
      kept->remember(backend_, context_.around, shared.get(), displacement.data());
    }
    stats.linear_iteration_count = linear.iterations;
    stats.linear_residual = linear.residual;
    return displacement;
  }

  /// Extends the displacement of the prescribed nodes to the interior of an intermediate mesh: the
  /// reference's coefficients fit worse the larger the displacement.
  void continue_displacement(const Prescribed<E, Real>& prescribed, const Vec3<Real>* valid,
                             Vec3f* displacement, MotionStats& stats) {
    const typename E::Timer timer(executor_, stats.linear_seconds);
    begin_displacement(executor_, job_.node_count, prescribed, displacement);
    const LaplaceSystem<E> system =
        build_laplace_system(executor_, context_.around, job_.rings.entries.size(), valid, false);
    LaplaceSolver<E> solver(executor_, context_.around, system);
    const LinearStats linear = solver.solve(displacement, [](Vec3f*) { return false; });
    stats.linear_iteration_count += linear.iterations;
    stats.linear_residual = linear.residual;
  }

  B& backend_;
  E& executor_;
  const SweepContext<E, Real>& context_;
  Colouring<E>& colouring_;
  std::optional<Optimizer<B, Real>> optimizer_;
  const JobMesh<E, Real>& job_;
  const JobPlan& plan_;
  const Move& method_;
  ConvergenceMonitor& monitor_;
  Vec3<Real>* positions_;
};

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "smooth/rules/optimize_rule.hpp"
#include "smooth/steps/convergence.hpp"

namespace meshsmooth::detail {

/// What one sweep of visits did.
struct OptimizeStats {
  SweepStats moves;
  double gain = 0;           // sum over the nodes of `Visit::gain`
  std::int64_t tangled = 0;  // balls not valid after their visit

  friend MESHSMOOTH_HD OptimizeStats operator+(const OptimizeStats& a, const OptimizeStats& b) {
    return {a.moves + b.moves, a.gain + b.gain, a.tangled + b.tangled};
  }
};

struct AddOptimizeStats {
  MESHSMOOTH_HD OptimizeStats operator()(const OptimizeStats& a, const OptimizeStats& b) const {
    return a + b;
  }
};

/// When a run of sweeps ends by what the last one did: a device can tell by itself.
struct PhaseEnd {
  bool when_untangled = false;  // no tangled ball is left
  double least_gain = 0;        // the sweep's gain is below
  double least_move = 0;        // the largest move is below, in the mesh's unit

  [[nodiscard]] MESHSMOOTH_HD bool after(const OptimizeStats& stats) const {
    return stats.moves.moved == 0 || (when_untangled && stats.tangled == 0) ||
           stats.gain < least_gain || std::sqrt(stats.moves.max_squared) < least_move;
  }
};

/// What a node's next visit needs to know of its last one.
enum VisitState : std::uint8_t {
  kAwake = 1,  // it, or a node around it, has moved since
  kTangledBall = 2,
  kHeldNode = 4,
};

/// One visit of every free node that is awake: in place, colour by colour. A node whose
/// surroundings are as at its last visit, when it did not move, would not move again: it
/// is asleep, which changes no bit.
///
/// cost   two to four looks at each ball
/// order  deterministic
template <int kDimension, Executor E, class Real>
OptimizeStats sweep_optimize(E& executor, const Surroundings& around, const Colouring<E>& colouring,
                             const OptimizePhase& phase, DisplacementLimit<Real> displacement_limit,
                             std::uint8_t* states, Vec3<Real>* positions) {
  const QuietPositions<Real> x{positions};
  OptimizeStats stats;
  for (std::size_t c = 0; c < colouring.count(); ++c) {
    const NodeId* const nodes = colouring.nodes.data() + colouring.first[c];
    stats = stats + executor.reduce(
                        colouring.first[c + 1] - colouring.first[c], OptimizeStats{},
                        [=] MESHSMOOTH_HD(std::size_t n) {
                          const auto node = static_cast<std::size_t>(nodes[n]);
                          const std::uint8_t state = states[node];
                          if ((state & kAwake) == 0) {
                            return OptimizeStats{{0, 0, 0, (state & kHeldNode) != 0 ? 1 : 0},
                                                 0,
                                                 (state & kTangledBall) != 0 ? 1 : 0};
                          }
                          const Vec3<Real> before = x[node];
                          const Visit<Real> visit = optimize_node<kDimension, E::kKeptCorners>(
                              SingleThread{}, around, x, node, phase, displacement_limit);
                          const bool moved = !(visit.place == before);
                          states[node] = static_cast<std::uint8_t>(
                              (moved ? kAwake : 0) | (visit.tangled ? kTangledBall : 0) |
                              (visit.held ? kHeldNode : 0));
                          if (moved) {
                            positions[node] = visit.place;
                            visit_adjacent(around, node, [&](NodeId other) {
                              if (static_cast<std::size_t>(other) != node) {
                                E::store(states[other], std::uint8_t{kAwake});
                              }
                              return true;
                            });
                          }
                          return OptimizeStats{stats_of_move(before, visit.place, visit.held),
                                               visit.gain, visit.tangled ? 1 : 0};
                        },
                        AddOptimizeStats{});
  }
  return stats;
}

/// The corners that can change, all together.
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

template <int kDimension>
MESHSMOOTH_HD MeshEnergy energy_of(const CornerTerm& term, int power) {
  const double volume = std::abs(term.volume);
  if (!(volume > 0)) return {0, term.weight, 0, 1};
  const CornerEnergy<kDimension> corner(volume, term.size);
  const double f = corner.stretch / kDimension;
  if (term.volume > 0 && corner.positive)
    return {term.weight * raise(f, power), term.weight, 1 / f, 0};
  return {0, term.weight, term.volume < 0 ? -1 / f : 1 / f, 1};
}

/// Judges the corners of which a node is free; one corner stands for a simplex.
/// cost   O(elements)
template <int kDimension, Executor E, class Real>
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
          sum = sum +
                energy_of<kDimension>(
                    corner_term<kDimension>(shape, k, -1, relative, around.reference_of(e)), power);
        }
        return sum;
      },
      [] MESHSMOOTH_HD(const MeshEnergy& a, const MeshEnergy& b) { return a + b; });
}

template <Executor E, class Real>
MeshEnergy measure_energy(E& executor, const Surroundings& around, const Vec3<Real>* positions,
                          int power) {
  return around.surface() ? measure_energy<2>(executor, around, positions, power)
                          : measure_energy<3>(executor, around, positions, power);
}

/// See `Convergence::energies`.
[[nodiscard]] inline double mean_energy(const MeshEnergy& energy, int power) {
  if (energy.invalid > 0) return std::numeric_limits<double>::infinity();
  return std::pow(energy.energy / energy.weight, 1.0 / power);
}

/// Sweeps of one job: the positions and what is known of every node.
template <Executor E, class Real>
class OptimizeSweeper {
 public:
  OptimizeSweeper(E& executor, const Surroundings& around, const Colouring<E>& colouring,
                  DisplacementLimit<Real> displacement_limit, Vec3<Real>* positions)
      : executor_(executor),
        around_(around),
        colouring_(colouring),
        displacement_limit_(displacement_limit),
        states_(executor.template allocate<std::uint8_t>(around.node_count)),
        positions_(positions) {}

  /// Before the first sweep of a phase.
  void wake_all() {
    std::uint8_t* const states = states_.data();
    executor_.for_each(around_.node_count,
                       [=] MESHSMOOTH_HD(std::size_t node) { states[node] = kAwake; });
  }

  OptimizeStats sweep(const OptimizePhase& phase) {
    return surface() ? sweep_optimize<2>(executor_, around_, colouring_, phase, displacement_limit_,
                                         states_.data(), positions_)
                     : sweep_optimize<3>(executor_, around_, colouring_, phase, displacement_limit_,
                                         states_.data(), positions_);
  }

  [[nodiscard]] MeshEnergy measure(int power) {
    return measure_energy(executor_, around_, positions_, power);
  }

  [[nodiscard]] bool surface() const { return around_.surface(); }
  [[nodiscard]] const Surroundings& around() const { return around_; }
  [[nodiscard]] const Colouring<E>& colouring() const { return colouring_; }
  [[nodiscard]] DisplacementLimit<Real> displacement_limit() const { return displacement_limit_; }
  [[nodiscard]] std::uint8_t* states() { return states_.data(); }
  [[nodiscard]] Vec3<Real>* positions() { return positions_; }

 private:
  E& executor_;
  const Surroundings& around_;
  const Colouring<E>& colouring_;
  DisplacementLimit<Real> displacement_limit_;
  typename E::template Buffer<std::uint8_t> states_;
  Vec3<Real>* positions_;
};

/// Decides after every sweep of a phase whether the phase goes on, and the job.
class PhaseMonitor {
 public:
  PhaseMonitor(ConvergenceMonitor& job, const OptimizePhase& phase, PhaseEnd end, double target)
      : job_(job), phase_(phase), end_(end), target_(target) {}

  /// True when the sweep just done was the phase's last. `energy` may be null unless
  /// `needs_energy`.
  [[nodiscard]] bool done(const OptimizeStats& stats, const MeshEnergy* energy) {
    return ended_by(stats, energy) || interrupted();
  }

  /// What `done` says from the sweeps alone.
  [[nodiscard]] bool ended_by(const OptimizeStats& stats, const MeshEnergy* energy) {
    job_.record(stats.moves);
    last_ = stats;
    ++sweeps_;
    if (job_.options().history)
      job_.record_energy(mean_energy(*energy, phase_.power), energy->worst);
    if (target_ > 0 && energy->worst >= target_) return end_job(StopReason::target_reached);
    if (end_.after(stats)) return true;
    if (job_.sweeps_left() == 0) return end_job(StopReason::iteration_limit);
    return end_.when_untangled && stuck();
  }

  [[nodiscard]] bool interrupted() {
    if (job_.interrupted()) job_ended_ = true;
    return job_ended_;
  }

  /// Whether the mesh must be measured after every sweep.
  [[nodiscard]] bool needs_energy() const { return job_.options().history || target_ > 0; }

  /// How many sweeps may be done at one go, if those that `end()` ends stop by themselves
  /// and the mesh need not be measured: no other rule ends the phase before.
  [[nodiscard]] int sweeps_ahead() const {
    if (needs_energy()) return 1;
    const int left = job_.sweeps_left();
    return end_.when_untangled ? std::min(left, lowest_at_ + kPatience - sweeps_) : left;
  }
  [[nodiscard]] const PhaseEnd& end() const { return end_; }

  /// After the phase: whether the job is over.
  [[nodiscard]] bool job_ended() const { return job_ended_; }
  [[nodiscard]] const OptimizeStats& last() const { return last_; }

 private:
  static constexpr int kPatience = 10;

  bool end_job(StopReason reason) { return job_ended_ = job_.end(reason); }

  /// The tangled balls have not become fewer for many sweeps.
  bool stuck() {
    if (last_.tangled < lowest_) {
      lowest_ = last_.tangled;
      lowest_at_ = sweeps_;
    }
    return sweeps_ - lowest_at_ >= kPatience;
  }

  ConvergenceMonitor& job_;
  const OptimizePhase& phase_;
  PhaseEnd end_;
  double target_;
  OptimizeStats last_;
  int sweeps_ = 0;
  int lowest_at_ = 0;
  std::int64_t lowest_ = std::numeric_limits<std::int64_t>::max();
  bool job_ended_ = false;
};

/// The sweeps of one phase, until its watch says that it is done. Backends may do several
/// at one go: `PhaseMonitor::sweeps_ahead`, `PhaseMonitor::end`.
template <Executor E, class Real>
void run_phase(E&, OptimizeSweeper<E, Real>& sweeper, const OptimizePhase& phase,
               PhaseMonitor& watch) {
  for (bool done = false; !done;) {
    const OptimizeStats stats = sweeper.sweep(phase);
    if (watch.needs_energy()) {
      const MeshEnergy energy = sweeper.measure(phase.power);
      done = watch.done(stats, &energy);
    } else {
      done = watch.done(stats, nullptr);
    }
  }
}

/// Asks where the element table is.
template <Executor E>
[[nodiscard]] bool only_tetrahedra(E& executor, const Elements& elements) {
  const int found = executor.reduce(
      std::size_t{1}, 0,
      [=] MESHSMOOTH_HD(std::size_t) {
        const ElementShape& shape = *elements.runs[0].shape;
        return elements.run_count == 1 && shape.dimension == 3 && shape.node_count == 4 ? 1 : 0;
      },
      [] MESHSMOOTH_HD(int a, int b) { return a + b; });
  return found == 1;
}

/// `Surroundings::opposite`. Without it a visit's loads wait for one another: ball, element,
/// place in the element, neighbours' order, positions.
/// cost   O(ball entries), 12 B each
template <Executor E>
typename E::template Buffer<NodeId> find_opposite_nodes(E& executor, const Surroundings& around) {
  auto opposite = executor.template allocate<NodeId>(3 * 4 * around.elements.count);
  NodeId* const out = opposite.data();
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    for (std::int64_t e = around.balls.offsets[node]; e < around.balls.offsets[node + 1]; ++e) {
      const ElementView element = around.elements[around.balls.entries[e]];
      const int own = local_node(element, static_cast<NodeId>(node));
      for (int m = 0; m < 3; ++m) {
        out[3 * e + m] = element.nodes[element.shape->corners[own].neighbours[m]];
      }
    }
  });
  return opposite;
}

[[nodiscard]] inline int power_of(Goal goal) {
  return goal == Goal::average ? 1 : goal == Goal::balanced ? 2 : 4;
}

/// Balls whose worst mean ratio is below are polished when no target is given.
inline constexpr double kPoorMeanRatio = 0.5;
/// The polish: norms that come ever closer to the worst corner's. A step straight up the
/// worst corner of each ball instead ends where no node can help alone, and lower.
inline constexpr int kRefinementPowers[] = {8, 16, 32};

/// Where the caller has the nodes, in executor memory.
template <class Real>
struct CallerPositions {
  const Vec3<Real>* positions;  // in the caller's order
  const NodeId* caller_ids;     // of a node of ours
};

/// The method Optimize: untangles where a ball is not valid, then goes down the goal's
/// energy, then polishes poor balls by high powers for Goal::worst.
///
/// takes  positions in internal order; `around` with balls
/// gives  the optimized positions in place. Valid elements are still valid; where not all
///        inverted ones could be mended, moves that broke a valid one are taken back.
/// cost   per sweep two to four looks at each ball; 1 B a node, 48 B a tetrahedron, for a
///        tangled mesh one more array of positions and that of `limit_moves`
/// order  deterministic
template <Executor E, class Real>
void optimize(E& executor, const Surroundings& surroundings, const Colouring<E>& colouring,
              const Optimize& method, DisplacementLimit<Real> displacement_limit,
              ConvergenceMonitor& watch, const CallerPositions<Real>& given,
              Vec3<Real>* positions) {
  const SmoothOptions& options = watch.options();
  Surroundings around = surroundings;
  typename E::template Buffer<NodeId> opposite;
  if (only_tetrahedra(executor, around.elements)) {
    opposite = find_opposite_nodes(executor, around);
    around.opposite = opposite.data();
  }
  OptimizeSweeper<E, Real> sweeper(executor, around, colouring, displacement_limit, positions);
  const MeshEnergy start = sweeper.measure(1);
  bool tangled = start.invalid > 0;
  if (method.target_quality > 0 && start.worst >= method.target_quality) {
    watch.end(StopReason::target_reached);
    return;
  }

  OptimizeStats last;
  // True when the job goes on.
  const auto run = [&](const OptimizePhase& phase, const PhaseEnd& end) {
    if (watch.sweeps_left() == 0) return !watch.end(StopReason::iteration_limit);
    PhaseMonitor phase_watch(watch, phase, end, method.target_quality);
    sweeper.wake_all();
    run_phase(executor, sweeper, phase, phase_watch);
    last = phase_watch.last();
    return !phase_watch.job_ended();
  };

  if (tangled) {
    const bool goes_on = run({.power = 1, .guard = false}, {.when_untangled = true});
    tangled = last.tangled > 0;
    if (tangled && options.guard) {
      const auto before = places_of(executor, given.positions, given.caller_ids, around.node_count);
      limit_moves(executor, around, {.guard = true, .facets = around.sliding.any()}, before.data(),
                  positions);
    }
    if (!goes_on) return;
  }

  const double tolerance = options.tolerance.value;
  const auto free_count = static_cast<double>(watch.free_count());
  const PhaseEnd converged{.least_gain = options.tolerance.relative ? tolerance * free_count : 0,
                           .least_move = options.tolerance.relative ? 0 : tolerance};
  if (!run({.power = power_of(method.goal), .guard = options.guard}, converged)) return;
  if (method.goal == Goal::worst) {
    const double poor = method.target_quality > 0 ? method.target_quality : kPoorMeanRatio;
    for (const int power : kRefinementPowers) {
      if (!run({.power = power, .poor = 1 / poor, .guard = options.guard}, converged)) return;
    }
  }
  const bool stuck = last.moves.moved == 0 && last.moves.held > 0;
  watch.end(last.tangled > 0 || stuck ? StopReason::stagnated : StopReason::converged);
}

}  // namespace meshsmooth::detail

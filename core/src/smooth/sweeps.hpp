#pragma once

#include "smooth/colouring.hpp"
#include "smooth/executor.hpp"
#include "smooth/rules.hpp"

namespace meshsmooth::detail {

/// What one sweep did.
struct SweepStats {
  double max_squared = 0;  // largest squared move
  double sum_squared = 0;
  std::int64_t moved = 0;
  std::int64_t held = 0;

  friend MESHSMOOTH_HD SweepStats operator+(const SweepStats& a, const SweepStats& b) {
    return {a.max_squared > b.max_squared ? a.max_squared : b.max_squared,
            a.sum_squared + b.sum_squared, a.moved + b.moved, a.held + b.held};
  }
};

struct AddStats {
  MESHSMOOTH_HD SweepStats operator()(const SweepStats& a, const SweepStats& b) const {
    return a + b;
  }
};

template <class Real>
MESHSMOOTH_HD SweepStats stats_of_move(Vec3<Real> before, Vec3<Real> after, bool held) {
  const Vec3d move = vec3_cast<double>(after) - vec3_cast<double>(before);
  const double squared = dot(move, move);
  return {squared, squared, before == after ? 0 : 1, held ? 1 : 0};
}

template <Executor E, class Real>
SweepStats measure_moves(E& executor, std::size_t node_count, const Vec3<Real>* before,
                         const Vec3<Real>* after) {
  return executor.reduce(
      node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        return stats_of_move(before[node], after[node], false);
      },
      AddStats{});
}

/// Takes back moves that were judged against positions which have changed since:
/// nodes with an element that the acceptance forbids return to where they were,
/// until every remaining move is acceptable. Ends, because all moves taken back
/// is acceptable. Returns how many were taken back.
///
/// cost   O(ball entries of moved nodes) per round, a few rounds; 1 B a node
/// order  deterministic
template <Executor E, class Real>
std::int64_t take_back_moves(E& executor, const Surroundings& around, const Vec3<Real>* before,
                             Vec3<Real>* after, Acceptance acceptance) {
  auto marks = executor.template allocate<std::uint8_t>(around.node_count);
  std::uint8_t* const mark = marks.data();
  const QuietPositions<Real> old_x{before};
  const QuietPositions<Real> new_x{after};
  std::int64_t total = 0;
  for (;;) {
    const std::int64_t count = executor.reduce(
        around.node_count, std::int64_t{0},
        [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
          mark[node] = 0;
          if (around.fixed[node] != 0 || before[node] == after[node]) return 0;
          const double worst = acceptance.smart ? worst_score(around, old_x, node) : 0.0;
          for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
            const double score = score_with(around, new_x, *e, node, after[node]);
            if ((acceptance.smart && score < worst) ||
                (acceptance.guard && !(score > 0) &&
                 score_with(around, old_x, *e, node, before[node]) > 0)) {
              mark[node] = 1;
              return 1;
            }
          }
          return 0;
        },
        [] MESHSMOOTH_HD(std::int64_t a, std::int64_t b) { return a + b; });
    if (count == 0) return total;
    total += count;
    executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      if (mark[node] != 0) after[node] = before[node];
    });
  }
}

/// Form A: reads `before`, writes `after`; they agree on fixed nodes.
/// cost   O(ring entries), O(ball entries) when the acceptance is active
template <Executor E, class Mean, class Real>
SweepStats sweep_jacobi(E& executor, const Surroundings& around, const Mean& mean, Real factor,
                        Acceptance acceptance, const Vec3<Real>* before, Vec3<Real>* after) {
  const QuietPositions<Real> x{before};
  SweepStats stats = executor.reduce(
      around.node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] != 0) return SweepStats{};
        bool held = false;
        Vec3<Real> place = step_towards(mean, around, x, node, factor);
        if (acceptance.active()) place = accept_move(around, x, node, place, acceptance, held);
        after[node] = place;
        return stats_of_move(before[node], place, held);
      },
      AddStats{});
  if (acceptance.active()) {
    const std::int64_t held =
        stats.held + take_back_moves(executor, around, before, after, acceptance);
    stats = measure_moves(executor, around.node_count, before, after);
    stats.held = held;
  }
  return stats;
}

/// Form B, deterministic: in place, colour by colour.
template <Executor E, class Mean, class Real>
SweepStats sweep_gauss_seidel(E& executor, const Surroundings& around,
                              const Colouring<E>& colouring, const Mean& mean, Real factor,
                              Acceptance acceptance, Vec3<Real>* positions) {
  const QuietPositions<Real> x{positions};
  SweepStats stats;
  for (std::size_t c = 0; c < colouring.count(); ++c) {
    const NodeId* const nodes = colouring.nodes.data() + colouring.first[c];
    stats = stats + executor.reduce(
                        colouring.first[c + 1] - colouring.first[c], SweepStats{},
                        [=] MESHSMOOTH_HD(std::size_t n) {
                          const auto node = static_cast<std::size_t>(nodes[n]);
                          bool held = false;
                          const Vec3<Real> before = x[node];
                          Vec3<Real> place = step_towards(mean, around, x, node, factor);
                          if (acceptance.active()) {
                            place = accept_move(around, x, node, place, acceptance, held);
                          }
                          positions[node] = place;
                          return stats_of_move(before, place, held);
                        },
                        AddStats{});
  }
  return stats;
}

/// Form B as in the paper: in place, every node as it comes. Not deterministic.
/// `before` keeps the positions of the sweep's start when the acceptance is
/// active, which judges the sweep as a whole.
template <Executor E, class Mean, class Real>
SweepStats sweep_racing(E& executor, const Surroundings& around, const Mean& mean, Real factor,
                        Acceptance acceptance, Vec3<Real>* before, Vec3<Real>* positions) {
  if (acceptance.active()) {
    executor.for_each(around.node_count,
                      [=] MESHSMOOTH_HD(std::size_t node) { before[node] = positions[node]; });
  }
  const typename E::template RacingPositions<Real> x{positions};
  SweepStats stats = executor.reduce(
      around.node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        if (around.fixed[node] != 0) return SweepStats{};
        bool held = false;
        const Vec3<Real> old_place = x[node];
        Vec3<Real> place = step_towards(mean, around, x, node, factor);
        if (acceptance.active()) place = accept_move(around, x, node, place, acceptance, held);
        x.store(node, place);
        return stats_of_move(old_place, place, held);
      },
      AddStats{});
  if (acceptance.active()) {
    const std::int64_t held =
        stats.held + take_back_moves(executor, around, before, positions, acceptance);
    stats = measure_moves(executor, around.node_count, before, positions);
    stats.held = held;
  }
  return stats;
}

/// One HC sweep, form A. `original` are the input positions, `differences` is
/// scratch of node_count. Source: Vollmer et al. 1999, section 4: p = mean(q);
/// b = p - (alpha o + (1 - alpha) q); p -= beta b + (1 - beta) mean(b).
template <Executor E, class Real>
SweepStats sweep_hc(E& executor, const Surroundings& around, Real alpha, Real beta,
                    Acceptance acceptance, const Vec3<Real>* original, const Vec3<Real>* before,
                    Vec3<Real>* after, Vec3<Real>* differences) {
  const QuietPositions<Real> x{before};
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const bool fixed = around.fixed[node] != 0;
    const Vec3<Real> mean = fixed ? before[node] : UniformMean{}(around, x, node);
    differences[node] = mean - (alpha * original[node] + (1 - alpha) * before[node]);
    if (!fixed) after[node] = mean;
  });
  const QuietPositions<Real> b{differences};
  std::int64_t held = executor.reduce(
      around.node_count, std::int64_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
        if (around.fixed[node] != 0) return 0;
        bool cut = false;
        const Vec3<Real> push =
            beta * differences[node] + (1 - beta) * UniformMean{}(around, b, node);
        Vec3<Real> place = after[node] - push;
        if (acceptance.active()) place = accept_move(around, x, node, place, acceptance, cut);
        after[node] = place;
        return cut ? 1 : 0;
      },
      [] MESHSMOOTH_HD(std::int64_t a, std::int64_t b_) { return a + b_; });
  if (acceptance.active()) {
    held += take_back_moves(executor, around, before, after, acceptance);
  }
  SweepStats stats = measure_moves(executor, around.node_count, before, after);
  stats.held = held;
  return stats;
}

}  // namespace meshsmooth::detail

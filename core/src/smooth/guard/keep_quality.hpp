#pragma once

#include <cmath>
#include <utility>

#include "mesh/measure.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/positions.hpp"
#include "smooth/base/surroundings.hpp"
#include "smooth/guard/kept_quality.hpp"

namespace meshsmooth::detail {

/// Bytes of `keep_quality`, which runs without the rings.
[[nodiscard]] inline std::int64_t keep_quality_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  return plan.keeps_quality ? mesh.nodes * (mesh.position_bytes + 1 + 4 + 8) : 0;
}

/// The measures of element `e` at the positions `x`.
template <class Real>
MESHSMOOTH_HD ElementMeasure measure_at(const Surroundings& around, const Vec3<Real>* x,
                                        std::size_t e) {
  const ElementView element = around.elements[e];
  Vec3d corners[kMaxCorners];
  for (int n = 0; n < element.shape->node_count; ++n) {
    corners[n] = vec3_cast<double>(x[element.nodes[n]]);
  }
  ElementMeasure measure = measure_element(*element.shape, corners, around.reference_of(e));
  measure.mean_ratio = finite_measure(measure.mean_ratio);
  measure.scaled_jacobian = finite_measure(measure.scaled_jacobian);
  return measure;
}

/// A mesh before and after, in executor memory, and the rules of `restore_below`.
template <class E, class Real>
struct Restoring {
  Surroundings around;
  QualityMetric metric;  // in force
  const Vec3<Real>* before;
  Vec3<Real>* after;
  std::uint8_t* marks;  // cleared
  QualityFloor floor{};

  /// Where the balls are not kept, a round visits all elements.
  [[nodiscard]] MESHSMOOTH_HD bool are_few(std::size_t changes) const {
    return around.balls.offsets != nullptr && changes < around.node_count / 16;
  }
  [[nodiscard]] MESHSMOOTH_HD std::size_t visits(const RoundChanges& changes) const {
    return around.sliding.facet_count +
           (are_few(changes.count) ? changes.count * E::kTeam : around.elements.count);
  }
  MESHSMOOTH_HD void visit(std::size_t n, const RoundChanges& changes) const {
    if (n < around.sliding.facet_count) return visit_facet(n);
    n -= around.sliding.facet_count;
    if (!are_few(changes.count)) return visit_element(n);
    const auto node = static_cast<std::size_t>(changes.nodes[n / E::kTeam]);
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node) + n % E::kTeam; e < end; e += E::kTeam) {
      visit_element(*e);
    }
  }
  [[nodiscard]] MESHSMOOTH_HD QualityChange change(std::size_t e) const {
    const ElementView element = around.elements[e];
    bool may_move = false;
    for (int n = 0; n < element.shape->node_count; ++n) {
      may_move = may_move || around.fixed[element.nodes[n]] == 0;
    }
    return change_of(measure_at(around, before, e), measure_at(around, after, e), may_move, metric);
  }
  /// Moves a node back. Whether it had moved.
  MESHSMOOTH_HD bool settle(std::size_t node) const {
    if (after[node] == before[node]) return false;
    after[node] = before[node];
    return true;
  }

 private:
  MESHSMOOTH_HD void visit_element(std::size_t e) const {
    const auto first = [&] { return measure_at(around, before, e); };
    if (!is_worse(floor, measure_at(around, after, e), first)) return;
    const ElementView element = around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) mark(element.nodes[n]);
  }
  MESHSMOOTH_HD void visit_facet(std::size_t f) const {
    if (!facet_turns(around.sliding, f, before, after)) return;
    for (const NodeId n : around.sliding.facets[f].nodes) {
      if (n >= 0) mark(n);
    }
  }
  MESHSMOOTH_HD void mark(NodeId node) const { E::store(marks[node], std::uint8_t{1}); }
};

/// The floor is that of the elements that may move.
template <Executor E, class Real>
QualityChange measure_change(E& executor, const Restoring<E, Real>& rules) {
  return executor.reduce(
      rules.around.elements.count, QualityChange{},
      [=] MESHSMOOTH_HD(std::size_t e) { return rules.change(e); }, Plus{});
}

/// Moves the nodes of elements below the floor back, in rounds, until none is: the set of those
/// that are back only grows, and an element all of whose nodes are back has its own quality.
///
/// cost   a measure per element, then rounds that visit the balls of what has changed
/// order  deterministic
template <Executor E, class Real>
void restore_below(E& executor, const Restoring<E, Real>& rules) {
  executor.run_rounds(
      rules.around.node_count, rules.marks,
      [=] MESHSMOOTH_HD(const RoundChanges& changes) { return rules.visits(changes); },
      [=] MESHSMOOTH_HD(std::size_t n, const RoundChanges& changes) { rules.visit(n, changes); },
      [=] MESHSMOOTH_HD(std::size_t node) { return rules.settle(node); },
      [](std::size_t, std::size_t, const RoundChanges&) { return 0U; });
}

/// Moves the nodes back in whose balls the sum of the metric fell.
///
/// cost   two measures per element
/// order  deterministic: sums of whole numbers
template <Executor E, class Real>
void restore_fallen(E& executor, const Restoring<E, Real>& rules) {
  constexpr double kUnit = 0x1p-40;
  using Sum = unsigned long long;  // modulo 2^64: atomic additions of a device have no sign
  const std::size_t node_count = rules.around.node_count;
  auto buffer = executor.template allocate<Sum>(node_count);
  Sum* const sums = buffer.data();
  const auto add = executor.adder();
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { sums[node] = 0; });
  executor.for_each(rules.around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
    const double gain = measure_in_force(measure_at(rules.around, rules.after, e), rules.metric) -
                        measure_in_force(measure_at(rules.around, rules.before, e), rules.metric);
    const auto whole = static_cast<Sum>(static_cast<long long>(std::llround(gain / kUnit)));
    const ElementView element = rules.around.elements[e];
    for (int n = 0; n < element.shape->node_count; ++n) add(sums[element.nodes[n]], whole);
  });
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (static_cast<long long>(sums[node]) < 0) rules.settle(node);
  });
}

/// Moves nodes back until no more elements are inverted than at first and, where `keeps_mean`, the
/// mean is kept: those that lower it, a few times, then all.
template <Executor E, class Real>
void restore_mean(E& executor, const Restoring<E, Real>& rules, bool keeps_mean) {
  constexpr int kMostRounds = 3;
  for (int round = 0;; ++round) {
    const QualityChange change = measure_change(executor, rules);
    const bool inverts = change.inverted_after > change.inverted_before;
    const bool falls = keeps_mean && is_mean_lower(change.before, change.after);
    if (!inverts && !falls) return;
    if (inverts || round == kMostRounds) {
      return copy_positions(executor, rules.around.node_count, rules.before, rules.after);
    }
    restore_fallen(executor, rules);
    restore_below(executor, rules);
  }
}

/// The last step: a result is not worse than its input. Moves nodes back where the elements that
/// may move have a lower least value than at first, of the metric in force and, unless the caller
/// named one, of the other one too, or a mean of the metric in force that is lower by more than
/// `kMostMeanLoss`.
///
/// gives  how many nodes went back for what
/// cost   a few measures per element, where the evaluation found a reason; `keep_quality_bytes`
/// order  deterministic
template <Executor E, class Real>
void keep_quality(E& executor, const Surroundings& around, const JobPlan& plan,
                  JobMesh<E, Real>& job, KeptQuality& kept) {
  const std::size_t count = job.node_count;
  auto before = positions_in_order(executor, job.given.data(), job.caller_ids.data(), count);
  auto buffer = executor.template allocate<std::uint8_t>(count);
  std::uint8_t* const marks = buffer.data();
  executor.for_each(count, [=] MESHSMOOTH_HD(std::size_t node) { marks[node] = 0; });
  Restoring<E, Real> rules{around, kept.metric, before.data(), job.positions.data(), marks};

  const auto count_moved = [&] {
    return measure_moves(executor, count, rules.before, rules.after).moved;
  };
  std::int64_t moved = count_moved();
  const auto restored = [&] {
    const std::int64_t now = count_moved();
    return std::exchange(moved, now) - now;
  };
  const auto restore = [&](const QualityFloor& floor) {
    rules.floor = floor;
    restore_below(executor, rules);
  };
  keep_least(measure_change(executor, rules).floor, plan, kept, restore, restored);
  restore_mean(executor, rules, plan.keeps_mean);
  kept.for_mean = restored();
}

}  // namespace meshsmooth::detail

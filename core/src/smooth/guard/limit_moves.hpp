#pragma once

#include "smooth/base/positions.hpp"
#include "smooth/guard/positive_tetrahedra.hpp"
#include "smooth/guard/sweep_context.hpp"

namespace meshsmooth::detail {

/// Bytes of `limit_moves` for n nodes.
[[nodiscard]] constexpr std::int64_t limit_moves_bytes(std::int64_t n, bool smart) {
  return n * (smart ? 2 + 4 + 8 : 2 + 4) + 3 * 4;
}

/// The rules of `limit_moves`, in executor memory; `E` tells how to store at the same time. For a
/// mesh that is known to have tetrahedra alone, or for any; `kSmart` is that of the acceptance.
template <class E, bool kTetrahedra, bool kSmart, class Real>
struct MoveLimits {
  Surroundings around;
  Acceptance acceptance;
  DisplacementLimit<Real> displacement_limit;
  const Vec3<Real>* before;
  Vec3<Real>* after;
  std::uint8_t* cuts;                   // how often each node's move was halved
  std::uint8_t* marks;                  // of the nodes that a visit found at fault
  double* floor;                        // smart: the worst quality of each ball before the sweep
  const ElementId* suspects = nullptr;  // where they are known: the elements to visit
  std::size_t suspect_count = 0;

  MESHSMOOTH_HD void start(std::size_t node) const {
    cuts[node] = 0;
    marks[node] = 0;
    if (kSmart && moves(node)) {
      floor[node] =
          worst_quality<kTetrahedra>(SingleThread{}, around, QuietPositions<Real>{before}, node);
    }
  }

  [[nodiscard]] MESHSMOOTH_HD bool suspects_known() const {
    return E::Suspects::kPossible && suspects != nullptr;
  }
  /// Below this number of changed nodes, visiting their balls costs less than all elements, of
  /// which a tenth of the nodes touches most, or than all suspects, which are visited in batches.
  [[nodiscard]] MESHSMOOTH_HD bool are_few(std::size_t changes) const {
    return changes < (suspects_known() ? suspect_count / 64 : around.node_count / 16);
  }
  [[nodiscard]] MESHSMOOTH_HD std::size_t facet_count() const {
    return acceptance.facets ? around.sliding.facet_count : 0;
  }
  /// How many visits of `visit` a round takes.
  [[nodiscard]] MESHSMOOTH_HD std::size_t visits(const RoundChanges& changes) const {
    if (are_few(changes.count)) return facet_count() + changes.count * E::kTeam;
    if (suspects_known()) return facet_count() + suspect_count;
    return facet_count() + (acceptance.guard || kSmart ? around.elements.count : 0);
  }
  /// The element that a visit of many is for.
  [[nodiscard]] MESHSMOOTH_HD std::size_t nth_of_many(std::size_t n) const {
    return suspects_known() ? static_cast<std::size_t>(suspects[n]) : n;
  }
  MESHSMOOTH_HD void visit(std::size_t n, const RoundChanges& changes) const {
    if (n < facet_count()) return visit_facet(n);
    n -= facet_count();
    if (!are_few(changes.count)) return visit_element(nth_of_many(n));
    const auto node = static_cast<std::size_t>(changes.nodes[n / E::kTeam]);
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node) + n % E::kTeam; e < end; e += E::kTeam) {
      visit_element(*e);
    }
  }
  MESHSMOOTH_HD void visit_element(std::size_t e) const {
    const QuietPositions<Real> old_x{before};
    const QuietPositions<Real> new_x{after};
    const ElementView element = around.elements.template get<kTetrahedra>(e);
    const double quality = kSmart ? quality_of<kTetrahedra>(around, new_x, e) : 0;
    const bool valid = kSmart ? quality > 0 : is_positive<kTetrahedra>(around, new_x, e);
    const bool broken = acceptance.guard && !valid && is_positive<kTetrahedra>(around, old_x, e);
    if (!broken && !kSmart) return;
    const int count = kTetrahedra ? 4 : element.shape->node_count;
    for (int n = 0; n < count; ++n) {
      const NodeId node = element.nodes[n];
      if (broken || (moves(node) && quality < floor[node])) mark(node);
    }
  }
  /// `visit_element` of a tetrahedron that moves broke.
  void visit_broken(std::size_t e) const {
    const NodeId* const nodes = around.elements.template get<true>(e).nodes;
    for (int n = 0; n < 4; ++n) mark(nodes[n]);
  }
  MESHSMOOTH_HD void visit_facet(std::size_t f) const {
    if (!facet_turns(around.sliding, f, before, after)) return;
    for (const NodeId n : around.sliding.facets[f].nodes) {
      if (n >= 0) mark(n);
    }
  }

  /// Cuts the move of a node at fault. Whether it had one.
  MESHSMOOTH_HD bool settle(std::size_t node) const {
    if (!moves(node)) return false;
    after[node] = ++cuts[node] < kMoveTrials ? part_of_way(around, displacement_limit, node,
                                                           before[node], after[node], Real(0.5))
                                             : before[node];
    return true;
  }

  [[nodiscard]] MESHSMOOTH_HD SweepStats stats(std::size_t node) const {
    return stats_of_move(before[node], after[node], cuts[node] != 0);
  }

 private:
  [[nodiscard]] MESHSMOOTH_HD bool moves(std::size_t node) const {
    return !(before[node] == after[node]);
  }
  MESHSMOOTH_HD void mark(NodeId node) const { E::store(marks[node], std::uint8_t{1}); }
};

/// Some visits of a round, where most tetrahedra keep their sign: of a host's executor, in batches.
/// Which are done, as bits.
template <class Limits>
unsigned int visit_tetrahedra(const Limits& limits, std::size_t first, std::size_t count,
                              const RoundChanges& changes) {
  if (first < limits.facet_count()) return 0;
  first -= limits.facet_count();
  const Surroundings& around = limits.around;
  const auto visit = [&](const auto& id, std::size_t size) {
    const unsigned int positive = positive_tetrahedra(around.elements, id, size, limits.after);
    for (std::size_t n = 0; n < size; ++n) {
      if ((positive >> n & 1U) != 0) continue;
      if (limits.suspects_known() && !limits.are_few(changes.count)) {
        limits.visit_broken(id(n));
      } else {
        limits.visit_element(id(n));
      }
    }
  };
  if (!limits.are_few(changes.count)) {
    visit([&](std::size_t n) { return limits.nth_of_many(first + n); }, count);
    return ~0U;
  }
  for (std::size_t n = first; n < first + count; ++n) {
    const auto node = static_cast<std::size_t>(changes.nodes[n]);
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end; e += kVisitBatch) {
      visit([&](std::size_t k) { return static_cast<std::size_t>(e[k]); },
            std::min(kVisitBatch, static_cast<std::size_t>(end - e)));
    }
  }
  return ~0U;
}

template <bool kTetrahedra, bool kSmart, Executor E, class Real>
SweepStats limit_moves_of(E& executor, const SweepContext<E, Real>& context,
                          const Vec3<Real>* before, Vec3<Real>* after) {
  const std::size_t node_count = context.around.node_count;
  auto cuts = executor.template allocate<std::uint8_t>(node_count);
  auto marks = executor.template allocate<std::uint8_t>(node_count);
  auto floor = executor.template allocate<double>(kSmart ? node_count : 0);
  MoveLimits<E, kTetrahedra, kSmart, Real> limits{
      context.around, context.acceptance, context.displacement_limit, before, after, cuts.data(),
      marks.data(),   floor.data()};
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { limits.start(node); });
  if constexpr (E::Suspects::kPossible && kTetrahedra && !kSmart) {
    const bool straight = !context.around.sliding.curved;
    if (context.suspects != nullptr && context.acceptance.guard && straight) {
      context.suspects->find(executor, context.around.elements, node_count, before, after);
      limits.suspects = context.suspects->data();
      limits.suspect_count = context.suspects->count();
    }
  }
  const auto visit_some = [=](std::size_t first, std::size_t count, const RoundChanges& changes) {
    return kTetrahedra && !kSmart ? visit_tetrahedra(limits, first, count, changes) : 0U;
  };
  executor.run_rounds(
      node_count, marks.data(),
      [=] MESHSMOOTH_HD(const RoundChanges& changes) { return limits.visits(changes); },
      [=] MESHSMOOTH_HD(std::size_t n, const RoundChanges& changes) { limits.visit(n, changes); },
      [=] MESHSMOOTH_HD(std::size_t node) { return limits.settle(node); }, visit_some);
  return executor.reduce(
      node_count, SweepStats{}, [=] MESHSMOOTH_HD(std::size_t node) { return limits.stats(node); },
      Plus{});
}

/// `accept_move` for all nodes of a sweep in which they did not see each other, in rounds:
/// while an element or facet violates the acceptance, the moves of its nodes (guard, facets)
/// or of the node whose ball it worsens (smart) are halved, and undone in the last trial.
/// Terminates, because a sweep with all moves undone is acceptable.
///
/// returns  what remains of the sweep
/// cost     one sign or quality per element, for smart one quality per ball entry more; then
///          rounds that visit only the balls of what has changed, and all facets at sliding nodes;
///          `limit_moves_bytes`
/// order    deterministic
/// tests    smoother_oracle_test compares with the oracle's node by node version
template <Executor E, class Real>
SweepStats limit_moves(E& executor, const SweepContext<E, Real>& context, const Vec3<Real>* before,
                       Vec3<Real>* after) {
  const auto run = [&]<bool kTetrahedra>(std::bool_constant<kTetrahedra>) {
    return context.acceptance.smart
               ? limit_moves_of<kTetrahedra, true>(executor, context, before, after)
               : limit_moves_of<kTetrahedra, false>(executor, context, before, after);
  };
  return context.around.elements.tetrahedra ? run(std::true_type()) : run(std::false_type());
}

}  // namespace meshsmooth::detail

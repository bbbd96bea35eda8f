#pragma once

#include "mesh/tetrahedron_batch.hpp"
#include "smooth/steps/positions.hpp"
#include "smooth/steps/sweep_context.hpp"

namespace meshsmooth::detail {

/// Bytes of `limit_moves` for n nodes.
[[nodiscard]] constexpr std::int64_t limit_moves_bytes(std::int64_t n, bool smart) {
  return n * (smart ? 3 + 8 : 3) + 3 * 4;
}

/// Those of the tetrahedra `id(0)`, … `id(count - 1)`, as bits, that are positive at `positions`.
template <class Real, class Id>
[[nodiscard]] unsigned int positive_tetrahedra(const Elements& elements, const Id& id,
                                               std::size_t count, const Vec3<Real>* positions) {
  static_assert(kVisitBatch == TetrahedronBatch::kSize);
  return run_wide([&] {
    TetrahedronBatch batch;
    for (std::size_t t = 0; t < kVisitBatch; ++t) {
      const std::size_t e = id(t < count ? t : 0);
      batch.set(static_cast<int>(t), positions, elements.get<true>(e).nodes);
    }
    const auto positive = batch.evaluate<1>([](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      return std::array{tetrahedron_is_positive(p0, p1, p2, p3) ? 1.0 : 0.0};
    })[0];
    unsigned int bits = 0;
    for (unsigned int t = 0; t < kVisitBatch; ++t) bits |= positive[t] != 0 ? 1U << t : 0U;
    return bits;
  });
}

/// `limit_moves` of a mesh that is known to have tetrahedra alone, or of any.
template <bool kTetrahedra, Executor E, class Real>
SweepStats limit_moves_of(E& executor, const SweepContext<E, Real>& context,
                          const Vec3<Real>* before, Vec3<Real>* after) {
  const Surroundings& around = context.around;
  const Acceptance acceptance = context.acceptance;
  const DisplacementLimit<Real> displacement_limit = context.displacement_limit;
  const std::size_t node_count = around.node_count;
  auto cut_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto mark_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto changed_buffer = executor.template allocate<std::uint8_t>(node_count);
  auto floor_buffer = executor.template allocate<double>(acceptance.smart ? node_count : 0);
  std::uint8_t* const cuts = cut_buffer.data();
  std::uint8_t* const marks = mark_buffer.data();
  std::uint8_t* const changed = changed_buffer.data();
  double* const floor = floor_buffer.data();
  const QuietPositions<Real> old_x{before};
  const QuietPositions<Real> new_x{after};

  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    const bool moves = !(before[node] == after[node]);
    cuts[node] = 0;
    marks[node] = 0;
    changed[node] = moves ? 1 : 0;
    if (acceptance.smart && moves)
      floor[node] = worst_quality<kTetrahedra>(SingleThread{}, around, old_x, node);
  });
  const auto mark = [=] MESHSMOOTH_HD(NodeId node) { E::store(marks[node], std::uint8_t{1}); };
  const auto visit_element = [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = around.elements.template get<kTetrahedra>(e);
    const bool signs = kTetrahedra && !acceptance.smart;  // where they suffice
    const double quality = signs ? 0 : quality_of<kTetrahedra>(around, new_x, e);
    const bool valid = signs ? is_positive<kTetrahedra>(around, new_x, e) : quality > 0;
    const bool broken = acceptance.guard && !valid && is_positive<kTetrahedra>(around, old_x, e);
    if (!broken && !acceptance.smart) return;
    const int count = kTetrahedra ? 4 : element.shape->node_count;
    for (int n = 0; n < count; ++n) {
      const NodeId node = element.nodes[n];
      if (broken || (!(before[node] == after[node]) && quality < floor[node])) mark(node);
    }
  };
  const SlidingConstraints sliding = around.sliding;
  const std::size_t facet_count = acceptance.facets ? sliding.facet_count : 0;
  const auto visit_facet = [=] MESHSMOOTH_HD(std::size_t f) {
    if (!facet_turns(sliding, f, before, after)) return;
    for (const NodeId n : sliding.facets[f].nodes) {
      if (n >= 0) mark(n);
    }
  };
  const std::size_t element_count =
      acceptance.guard || acceptance.smart ? around.elements.count : 0;
  const auto touched = [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = around.elements.template get<kTetrahedra>(e);
    const int count = kTetrahedra ? 4 : element.shape->node_count;
    bool any = false;
    for (int n = 0; n < count; ++n) any |= changed[element.nodes[n]] != 0;
    return any;
  };
  // Below this share of changed nodes, visiting their balls costs less than all elements.
  const std::size_t few = node_count / 16;
  const auto visits = [=] MESHSMOOTH_HD(std::size_t changes) {
    return facet_count + (changes < few ? node_count * E::kTeam : element_count);
  };
  const auto visit = [=] MESHSMOOTH_HD(std::size_t n, std::size_t changes) {
    if (n < facet_count) return visit_facet(n);
    n -= facet_count;
    if (!(changes < few)) {
      if (touched(n)) visit_element(n);
      return;
    }
    const std::size_t node = n / E::kTeam;
    if (changed[node] == 0) return;
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node) + n % E::kTeam; e < end; e += E::kTeam) {
      visit_element(*e);
    }
  };
  const auto settle = [=] MESHSMOOTH_HD(std::size_t node) {
    const bool bad = marks[node] != 0 && !(before[node] == after[node]);
    marks[node] = 0;
    changed[node] = bad ? 1 : 0;
    if (bad) {
      after[node] = ++cuts[node] < kMoveTrials ? part_of_way(around, displacement_limit, node,
                                                             before[node], after[node], Real(0.5))
                                               : before[node];
    }
    return bad;
  };
  // Of the host's tetrahedra most keep their sign, in batches.
  const auto visit_some = [=](std::size_t first, std::size_t count, std::size_t changes) {
    if (!kTetrahedra || acceptance.smart || first < facet_count) return 0U;
    first -= facet_count;
    if (!(changes < few)) {
      return positive_tetrahedra(
          around.elements, [=](std::size_t n) { return first + n; }, count, after);
    }
    for (std::size_t node = first; node < first + count; ++node) {
      if (changed[node] == 0) continue;
      const ElementId* const end = around.balls.end(node);
      for (const ElementId* e = around.balls.begin(node); e < end; e += kVisitBatch) {
        const auto size = std::min(kVisitBatch, static_cast<std::size_t>(end - e));
        const unsigned int positive = positive_tetrahedra(
            around.elements, [=](std::size_t n) { return std::size_t{e[n]}; }, size, after);
        for (std::size_t n = 0; n < size; ++n) {
          if ((positive >> n & 1U) == 0) visit_element(e[n]);
        }
      }
    }
    return ~0U;
  };
  executor.run_rounds(node_count, visits, visit, settle, visit_some);
  return executor.reduce(
      node_count, SweepStats{},
      [=] MESHSMOOTH_HD(std::size_t node) {
        return stats_of_move(before[node], after[node], cuts[node] != 0);
      },
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
  return context.around.elements.tetrahedra
             ? limit_moves_of<true>(executor, context, before, after)
             : limit_moves_of<false>(executor, context, before, after);
}

}  // namespace meshsmooth::detail

#include "smooth/second_order/second_order_job.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "mesh/parallel.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/base/interrupt.hpp"
#include "smooth/base/refusals.hpp"
#include "smooth/move/prescribed.hpp"
#include "smooth/second_order/count_poor.hpp"
#include "smooth/second_order/keep_curved_quality.hpp"
#include "smooth/second_order/mid_derivatives.hpp"
#include "smooth/second_order/mid_nodes.hpp"
#include "smooth/second_order/prescribed_parts.hpp"
#include "smooth/second_order/repair_curved.hpp"
#include "smooth/second_order/right_angled.hpp"
#include "smooth/second_order/stopwatch.hpp"

namespace meshsmooth::detail {
namespace {

template <class Real>
class Job {
  using Positions = std::span<const Vec3<Real>>;

 public:
  Job(const SecondOrderTask<Real>& task, const JobArrays<Real>& arrays)
      : arena_(task.arena),
        topology_(task.topology),
        mesh_(task.mesh),
        positions_(arrays.given),
        input_(arrays.input),
        plan_(task.plan),
        options_(plan_.options),
        control_(task.control),
        run_(task.run),
        orientation_(run_in(arena_, [&] { return SurfaceOrientation(topology_, positions_); })),
        mid_nodes_(run_in(
            arena_, [&] { return MidNodes<Real>(topology_, mesh_, positions_, orientation_); })) {}

  SmoothSummary smooth(std::span<Vec3<Real>> result) {
    const bool moves = plan_.moves;
    QualityStats before;
    if (mid_nodes_.any_curved()) {
      before = measure(positions_);
      if (!topology_.canonical && before.inverted_count + before.degenerate_count > 0 &&
          CanonicalTopology(topology_, positions_).changed()) {
        throw NotCanonical{};
      }
      refuse_tangled(before, options_.tangled);
      if (moves) refuse_tangled_reference(before);
    }
    const bool curved_surface = element_dimension() == 2 && !orientation_.plane();
    const bool keeps_shape = options_.boundary == BoundaryPolicy::slide || curved_surface;
    // A corner that slides along the facets of the input leaves the curve that they approximate.
    const auto held = keeps_shape ? mid_nodes_.corners_of_curved() : std::vector<NodeId>();
    if (plan_.derivative != Derivative::none) return differentiate(held, std::move(before), result);

    std::vector<Vec3<Real>> after;
    SmoothSummary summary = moves ? move(held, after) : sweep(held, after);
    summary.nodes.curved += static_cast<std::int64_t>(held.size());
    if (mid_nodes_.any_curved()) evaluate(summary, std::move(before), after);
    if (recounts_poor()) {
      const Stopwatch stopwatch(iterate_seconds_);
      const std::vector<Vec3<Real>> first = gather(positions_, mesh_);
      count_poor<Real>(run_, {of_corners(), options_, held}, first, gather<Real>(after, mesh_),
                       summary);
    }
    report(summary, after);
    summary.times.iterate_seconds += iterate_seconds_;
    summary.times.evaluate_seconds += evaluate_seconds_;
    std::copy(after.begin(), after.end(), result.begin());
    return summary;
  }

 private:
  [[nodiscard]] int element_dimension() const {
    return element_shape(topology_.blocks.front().type).dimension;
  }

  /// Whether poor elements are counted when curved elements have been repaired.
  [[nodiscard]] bool recounts_poor() const {
    return mid_nodes_.any_curved() && can_count_poor(plan_);
  }

  SmoothSummary sweep(const std::vector<NodeId>& held, std::vector<Vec3<Real>>& after) {
    std::vector<Vec3<Real>> corners = gather(positions_, mesh_);
    SmoothOptions options = options_;
    if (mid_nodes_.any_curved()) options.never_worse = false;  // whole elements are kept below
    if (recounts_poor()) options.report_below = {};
    SmoothSummary summary = run_(corners, of_corners(), options, held);
    const Stopwatch stopwatch(iterate_seconds_);
    const std::vector<std::uint8_t> right_angled = find_right_angled();
    for (std::size_t n = 0; n < right_angled.size(); ++n) {
      const NodeId corner = mesh_.corner_of(static_cast<NodeId>(n));
      if (right_angled[n] != 0 && corner >= 0) corners[std::size_t(corner)] = positions_[n];
    }
    if (options_.guard) {
      summary.convergence.held_node_count +=
          run_in(arena_, [&] { return mid_nodes_.place_validly(corners, after); });
    } else {
      run_in(arena_, [&] { mid_nodes_.place(corners, after); });
    }
    if (plan_.improves() && mid_nodes_.any_curved()) {
      const std::int64_t held_bytes = run_in(arena_, [&] {
        return repair_elements(summary.convergence.bounding_box_diagonal, right_angled, after);
      });
      // What the corners' job held is free by now.
      summary.host_peak_bytes = std::max(summary.host_peak_bytes, held_bytes);
    }
    return summary;
  }

  /// The nodes that already have what `Target::automatic` aims at; empty: none.
  [[nodiscard]] std::vector<std::uint8_t> find_right_angled() const {
    if (plan_.aim != Aim::boxes || !mid_nodes_.any_curved()) return {};
    return run_in(arena_,
                  [&] { return detail::find_right_angled(topology_, orientation_, positions_); });
  }

  /// On curved surfaces nodes would leave the surface.
  [[nodiscard]] std::int64_t repair_elements(double diagonal,
                                             const std::vector<std::uint8_t>& right_angled,
                                             std::vector<Vec3<Real>>& after) const {
    if (element_dimension() == 2 && !orientation_.plane()) return 0;
    RepairScope<Real> scope{{topology_.fixed.begin(), topology_.fixed.end()}};
    scope.held.resize(topology_.node_count);
    if (const auto& limit = options_.movement_limit) {
      scope.limit = {positions_.data(), limit->value * (limit->relative ? diagonal : 1)};
    }
    if (options_.only_below) scope.rings = options_.only_below->rings;
    const auto goes_on = [&] {
      Interrupt(control_).check();
      const bool ends = control_.finish_early != nullptr && control_.finish_early->load();
      return !ends && (!options_.compute_budget ||
                       std::chrono::steady_clock::now() - begin_ < *options_.compute_budget);
    };
    const std::span<Vec3<Real>> all(after);
    const auto by = [&](RepairGoal goal, const RepairScope<Real>& within) {
      return repair_curved(goal, topology_, within, orientation_, all, goes_on);
    };
    const std::int64_t bytes = by(RepairGoal::validity, scope);
    if (options_.only_below) return bytes;  // distorted elements are not bad ones
    for (std::size_t n = 0; n < right_angled.size(); ++n) scope.held[n] |= right_angled[n];
    // The corners have been optimized: they move only where that is not enough.
    RepairScope<Real> mids = scope;
    for (const NodeId node : mesh_.nodes()) mids.held[static_cast<std::size_t>(node)] = 1;
    return std::max({bytes, by(RepairGoal::shape, mids), by(RepairGoal::worst_shapes, scope)});
  }

  /// In place of `move`: the mesh stays.
  SmoothSummary differentiate(const std::vector<NodeId>& held, QualityStats before,
                              std::span<Vec3<Real>> result) {
    const MidDerivatives<Real> derivatives(topology_, mesh_, input_);
    std::vector<Vec3<Real>> corners = gather(positions_, mesh_);
    SmoothSummary summary = run_(corners, derivatives.of_corners(), options_, held);
    summary.nodes.curved += static_cast<std::int64_t>(held.size());
    if (mid_nodes_.any_curved()) {
      if (options_.quality_detail == QualityDetail::brief) before.metrics.clear();
      summary.quality_before = summary.quality_after = std::move(before);
    }
    report(summary, positions_);
    derivatives.place(corners, result);
    return summary;
  }

  /// As far as curved elements stay valid: with half the motion until they do.
  SmoothSummary move(const std::vector<NodeId>& held, std::vector<Vec3<Real>>& after) {
    const PrescribedParts<Real> prescribed(input_.prescribed, mesh_);
    JobInput input = of_corners();
    const double least = std::get<Move>(options_.method).least_step;
    SmoothSummary summary;
    int halvings = 0;
    for (double share = 1;; share /= 2) {
      if (share < least) share = 0;
      std::vector<Vec3<Real>> corners = gather(positions_, mesh_);
      std::vector<Vec3<Real>> to = prescribed.corner_positions;
      for (std::size_t n = 0; n < to.size(); ++n) {
        const Vec3<Real> from = corners[static_cast<std::size_t>(prescribed.corners[n])];
        if (share < 1) to[n] = towards(from, to[n], share);
      }
      input.prescribed = {prescribed.corners, std::span<const Vec3<Real>>(to)};
      summary = run_(corners, input, options_, held);
      MotionStats& motion = *summary.motion;
      motion.reached *= share;
      motion.rejected_step_count += halvings++;
      if (share < 1) summary.stop_reason = StopReason::stagnated;
      const Stopwatch stopwatch(iterate_seconds_);
      run_in(arena_, [&] { mid_nodes_.place(corners, after); });
      for (std::size_t n = 0; n < prescribed.mids.size(); ++n) {
        const auto node = static_cast<std::size_t>(prescribed.mids[n]);
        after[node] = motion.reached == 1
                          ? prescribed.mid_positions[n]
                          : towards(positions_[node], prescribed.mid_positions[n], motion.reached);
      }
      if (share == 0 || run_in(arena_, [&] { return mid_nodes_.stays_valid(after); }))
        return summary;
    }
  }

  /// What the linear mesh's job is given: the reference of its nodes.
  [[nodiscard]] JobInput of_corners() {
    JobInput input;
    if (plan_.aim != Aim::reference) return input;
    std::visit(
        [&]<class R>(std::span<const Vec3<R>> all) {
          reference_ = gather(all, mesh_);
          input.reference = std::span<const Vec3<R>>(std::get<std::vector<Vec3<R>>>(reference_));
        },
        input_.reference);
    return input;
  }

  [[nodiscard]] QualityStats measure(Positions positions) {
    const Stopwatch stopwatch(evaluate_seconds_);
    return run_in(arena_, [&] {
      return measure_quality(topology_, positions, orientation_, {}, plan_.evaluated_detail);
    });
  }

  /// Evaluates whole curved elements, and moves back what is worse than before.
  void evaluate(SmoothSummary& summary, QualityStats before, std::vector<Vec3<Real>>& after) {
    summary.quality_before = std::move(before);
    summary.quality_after = measure(after);
    if (plan_.keeps_quality) {
      KeptQuality& kept =
          summary.kept_quality.emplace(KeptQuality{metric_in_force(topology_, plan_)});
      if (may_be_worse(summary.quality_before, summary.quality_after, {}, plan_, kept.metric)) {
        summary.host_peak_bytes =
            std::max(summary.host_peak_bytes, keep_curved_quality_bytes(summary.nodes.total));
        const Stopwatch stopwatch(evaluate_seconds_);
        run_in(arena_, [&] {
          keep_curved_quality(topology_, orientation_, plan_, summary.quality_before, positions_,
                              std::span<Vec3<Real>>(after), kept);
        });
      }
      if (kept.restored_node_count() > 0) summary.quality_after = measure(after);
    }
    if (options_.quality_detail == QualityDetail::full) return;
    summary.quality_before.metrics.clear();
    summary.quality_after.metrics.clear();
  }

  /// Says what the linear mesh's summary does not know.
  void report(SmoothSummary& summary, Positions after) {
    for (QualityStats* quality : {&summary.quality_before, &summary.quality_after}) {
      for (ElementQuality& element : quality->worst) element.type = type_of(element.element);
    }
    if (summary.locked.worst) {
      summary.locked.worst->type = type_of(summary.locked.worst->element);
    }
    summary.nodes.total = static_cast<std::int64_t>(topology_.node_count);
    summary.nodes.moved = 0;
    for (std::size_t n = 0; n < after.size(); ++n) {
      if (!(after[n] == positions_[n])) ++summary.nodes.moved;
    }
  }

  [[nodiscard]] ElementType type_of(std::int64_t element) const {
    auto rest = static_cast<std::size_t>(element);
    for (const ElementBlockView& block : topology_.blocks) {
      if (rest < block.element_count()) return block.type;
      rest -= block.element_count();
    }
    return topology_.blocks.back().type;
  }

  tbb::task_arena& arena_;
  const TopologyView& topology_;
  const CornerMesh& mesh_;
  Positions positions_;  // at first
  const JobInput& input_;
  const JobPlan& plan_;
  const SmoothOptions& options_;  // of the plan
  const JobControl& control_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  const SmoothCorners<Real>& run_;
  SurfaceOrientation orientation_;
  MidNodes<Real> mid_nodes_;
  std::variant<std::vector<Vec3f>, std::vector<Vec3d>> reference_;
  double iterate_seconds_ = 0;  // beside what the linear mesh's job takes
  double evaluate_seconds_ = 0;
};

}  // namespace

template <class Real>
SmoothSummary smooth_second_order(const SecondOrderTask<Real>& task,
                                  const JobArrays<Real>& arrays) {
  return Job<Real>(task, arrays).smooth(arrays.result);
}

template SmoothSummary smooth_second_order(const SecondOrderTask<float>&, const JobArrays<float>&);
template SmoothSummary smooth_second_order(const SecondOrderTask<double>&,
                                           const JobArrays<double>&);

}  // namespace meshsmooth::detail

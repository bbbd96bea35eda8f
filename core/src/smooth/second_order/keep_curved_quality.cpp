#include "smooth/second_order/keep_curved_quality.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "mesh/curved_jacobian.hpp"
#include "smooth/second_order/repaired_part.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {
namespace {

template <class Real>
class CurvedKeeper {
 public:
  CurvedKeeper(const TopologyView& topology, const SurfaceOrientation& orientation,
               std::span<const Vec3<Real>> before, std::span<Vec3<Real>> after)
      : topology_(topology),
        orientation_(orientation),
        before_(before),
        after_(after),
        marks_(before.size()),
        moved_(count_moved()) {}

  /// @returns how many nodes have gone back since the last call
  std::int64_t take_restored() {
    const std::int64_t now = count_moved();
    return std::exchange(moved_, now) - now;
  }

  /// Moves the nodes of elements below the floor back, in rounds, until none is.
  void restore_below(const QualityFloor& floor) {
    floor_ = floor;
    std::vector<std::uint8_t> changed(marks_.size(), 1);  // by the last round
    for (bool any = true; any;) {
      for_each_moved([&](ElementType type, std::span<const NodeId> nodes, Vec3d reference) {
        if (std::ranges::none_of(nodes, [&](NodeId n) { return changed[index(n)] != 0; })) return;
        const auto first = [&] { return measure(type, nodes, first_positions(), reference); };
        if (is_worse(floor_, measure(type, nodes, positions(), reference), first)) {
          mark_nodes(nodes, marks_);
        }
      });
      any = false;
      for (std::size_t n = 0; n < marks_.size(); ++n) {
        changed[n] = std::exchange(marks_[n], std::uint8_t{0}) != 0 && restore(n) ? 1 : 0;
        any = any || changed[n] != 0;
      }
    }
  }

  /// Moves nodes back until no more elements are inverted than at first and, where `keeps_mean`,
  /// the mean is kept, as the floor is: those in whose balls its sum fell, a few times, then all.
  void restore_mean(QualityMetric metric, bool keeps_mean, const QualityStats& first) {
    constexpr int kMostRounds = 3;
    const auto* const stats =
        std::ranges::find(first.metrics.data(), first.metrics.data() + first.metrics.size(), metric,
                          &MetricStats::metric);
    const double sum = stats->mean * static_cast<double>(first.element_count);
    for (int round = 0;; ++round) {
      const Gains gains = find_gains(metric);
      const double gained = kUnit * static_cast<double>(gains.all);
      const bool inverts = gains.inverted > 0;
      if (!inverts && !(keeps_mean && is_mean_lower(sum, sum + gained))) return;
      const bool all = inverts || round == kMostRounds;
      for (std::size_t n = 0; n < after_.size(); ++n) {
        if (all || gains.of_balls[n] < 0) restore(n);
      }
      if (all) return;
      restore_below(floor_);
    }
  }

 private:
  /// What elements have more than at first; as whole numbers, sums have no order.
  struct Gains {
    std::vector<std::int64_t> of_balls;  // in `kUnit`
    std::int64_t all = 0;
    std::int64_t inverted = 0;
  };
  static constexpr double kUnit = 0x1p-40;

  [[nodiscard]] static std::size_t index(NodeId node) { return static_cast<std::size_t>(node); }
  [[nodiscard]] std::span<const Vec3<Real>> positions() const { return after_; }
  [[nodiscard]] std::span<const Vec3<Real>> first_positions() const { return before_; }
  [[nodiscard]] bool has_moved(std::size_t node) const { return !(after_[node] == before_[node]); }

  [[nodiscard]] std::int64_t count_moved() const {
    std::int64_t count = 0;
    for (std::size_t n = 0; n < after_.size(); ++n) count += has_moved(n) ? 1 : 0;
    return count;
  }

  /// @returns whether the node had moved
  bool restore(std::size_t node) {
    if (!has_moved(node)) return false;
    after_[node] = before_[node];
    return true;
  }

  static ElementMeasure measure(ElementType type, std::span<const NodeId> nodes,
                                std::span<const Vec3<Real>> at, Vec3d reference) {
    ElementMeasure found = measure_nodes(type, positions_of(nodes, at).data(), reference);
    found.mean_ratio = finite_measure(found.mean_ratio);
    found.scaled_jacobian = finite_measure(found.scaled_jacobian);
    return found;
  }

  /// Calls `visit(type, nodes, reference)` for the elements that have a node that moved.
  template <class Visit>
  void for_each_moved(const Visit& visit) const {
    for_each_element(
        topology_, [&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
          if (std::ranges::any_of(nodes, [&](NodeId node) { return has_moved(index(node)); }))
            visit(type, nodes, orientation_.reference(element));
        });
  }

  [[nodiscard]] Gains find_gains(QualityMetric metric) const {
    Gains gains{std::vector<std::int64_t>(after_.size())};
    const auto add = [](std::int64_t& to, std::int64_t value) {
      std::atomic_ref(to).fetch_add(value, std::memory_order_relaxed);
    };
    for_each_moved([&](ElementType type, std::span<const NodeId> nodes, Vec3d reference) {
      const ElementMeasure first = measure(type, nodes, first_positions(), reference);
      const ElementMeasure last = measure(type, nodes, positions(), reference);
      const double gain = measure_in_force(last, metric) - measure_in_force(first, metric);
      const std::int64_t whole = std::llround(gain / kUnit);
      for (const NodeId node : nodes) add(gains.of_balls[index(node)], whole);
      add(gains.all, whole);
      add(gains.inverted, (last.inverted ? 1 : 0) - (first.inverted ? 1 : 0));
    });
    return gains;
  }

  const TopologyView& topology_;
  const SurfaceOrientation& orientation_;
  std::span<const Vec3<Real>> before_;
  std::span<Vec3<Real>> after_;
  std::vector<std::uint8_t> marks_;
  std::int64_t moved_;
  QualityFloor floor_;
};

}  // namespace

template <class Real>
void keep_curved_quality(const TopologyView& topology, const SurfaceOrientation& orientation,
                         const JobPlan& plan, const QualityStats& quality_before,
                         std::span<const Vec3<Real>> before, std::span<Vec3<Real>> after,
                         KeptQuality& kept) {
  QualityFloor least;
  for (const MetricStats& stats : quality_before.metrics) {
    if (stats.metric == QualityMetric::mean_ratio) least.mean_ratio = stats.min;
    if (stats.metric == QualityMetric::scaled_jacobian) least.scaled_jacobian = stats.min;
  }
  CurvedKeeper<Real> keeper(topology, orientation, before, after);
  keep_least(
      least, plan, kept, [&](const QualityFloor& floor) { keeper.restore_below(floor); },
      [&] { return keeper.take_restored(); });
  keeper.restore_mean(kept.metric, plan.keeps_mean, quality_before);
  kept.for_mean = keeper.take_restored();
}

template void keep_curved_quality(const TopologyView&, const SurfaceOrientation&, const JobPlan&,
                                  const QualityStats&, std::span<const Vec3f>, std::span<Vec3f>,
                                  KeptQuality&);
template void keep_curved_quality(const TopologyView&, const SurfaceOrientation&, const JobPlan&,
                                  const QualityStats&, std::span<const Vec3d>, std::span<Vec3d>,
                                  KeptQuality&);

}  // namespace meshsmooth::detail

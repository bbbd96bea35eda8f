// Judging all elements of a mesh in one pass.

#include "meshsmooth/quality.hpp"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace meshsmooth {
namespace {

constexpr std::size_t kMetricCount = 7;
constexpr std::size_t kBinCount = 2048;
constexpr std::size_t kHistogramSize = 32;
constexpr std::size_t kWorstCount = 10;
/// Sums are made chunk by chunk and added in order, so that their bits do not
/// depend on the number of threads.
constexpr std::size_t kChunk = 8192;

struct MetricScale {
  std::string_view name;
  double lower, upper;
};

constexpr std::array<MetricScale, kMetricCount> kScales = {{{"mean_ratio", -1, 1},
                                                            {"scaled_jacobian", -1, 1},
                                                            {"radius_ratio", -1, 1},
                                                            {"min_dihedral_angle", 0, 180},
                                                            {"max_dihedral_angle", 0, 180},
                                                            {"min_angle", 0, 180},
                                                            {"max_angle", 0, 180}}};

double degrees(double cosine) { return std::acos(cosine) * (180 / std::numbers::pi); }

bool worse(const ElementQuality& a, const ElementQuality& b) {
  return a.mean_ratio != b.mean_ratio ? a.mean_ratio < b.mean_ratio : a.element < b.element;
}

struct ChunkSums {
  std::array<double, kMetricCount> values{};
  double volume = 0;
};

/// What one thread has counted. Nothing here depends on the order of elements.
struct Tally {
  std::array<std::array<std::int64_t, kBinCount>, kMetricCount> bins{};
  std::array<double, kMetricCount> min, max;
  std::int64_t inverted = 0, degenerate = 0;
  std::vector<ElementQuality> worst;  // a heap, the least bad on top

  Tally() {
    min.fill(std::numeric_limits<double>::infinity());
    max.fill(-std::numeric_limits<double>::infinity());
  }

  void add(QualityMetric metric, double value, ChunkSums& sums) {
    const auto m = static_cast<std::size_t>(metric);
    const MetricScale& scale = kScales[m];
    if (!std::isfinite(value)) value = 0;  // coordinates whose products overflow
    const double place = (value - scale.lower) * (kBinCount / (scale.upper - scale.lower));
    ++bins[m][static_cast<std::size_t>(std::clamp(place, 0.0, kBinCount - 1.0))];
    min[m] = std::min(min[m], value);
    max[m] = std::max(max[m], value);
    sums.values[m] += value;
  }

  void add(const ElementMeasure& measure, ElementType type, std::int64_t element, ChunkSums& sums) {
    inverted += measure.inverted ? 1 : 0;
    degenerate += measure.degenerate ? 1 : 0;
    sums.volume += std::abs(measure.volume);
    add(QualityMetric::mean_ratio, measure.mean_ratio, sums);
    add(QualityMetric::scaled_jacobian, measure.scaled_jacobian, sums);
    if (type == ElementType::tetrahedron) {
      add(QualityMetric::radius_ratio, measure.radius_ratio, sums);
      add(QualityMetric::min_dihedral_angle, degrees(measure.min_angle_cos), sums);
      add(QualityMetric::max_dihedral_angle, degrees(measure.max_angle_cos), sums);
    } else if (type == ElementType::triangle) {
      add(QualityMetric::min_angle, degrees(measure.min_angle_cos), sums);
      add(QualityMetric::max_angle, degrees(measure.max_angle_cos), sums);
    }
    keep_if_worst({element, type, measure.mean_ratio, measure.scaled_jacobian});
  }

  void keep_if_worst(const ElementQuality& quality) {
    if (worst.size() == kWorstCount) {
      if (!worse(quality, worst.front())) return;
      std::pop_heap(worst.begin(), worst.end(), worse);
      worst.pop_back();
    }
    worst.push_back(quality);
    std::push_heap(worst.begin(), worst.end(), worse);
  }

  void merge(const Tally& other) {
    for (std::size_t m = 0; m < kMetricCount; ++m) {
      for (std::size_t b = 0; b < kBinCount; ++b) bins[m][b] += other.bins[m][b];
      min[m] = std::min(min[m], other.min[m]);
      max[m] = std::max(max[m], other.max[m]);
    }
    inverted += other.inverted;
    degenerate += other.degenerate;
    for (const ElementQuality& quality : other.worst) keep_if_worst(quality);
  }
};

/// A run of elements of one type.
template <class Real>
struct ElementRun {
  ElementType type;
  const NodeId* nodes;
  std::size_t begin, end;  // inside the block
  std::size_t first_id;    // of the block
  const Vec3<Real>* positions;
  const std::uint32_t* names;  // of all elements, or null

  [[nodiscard]] std::int64_t id_of(std::size_t element) const {
    const std::size_t place = first_id + element;
    return names == nullptr ? static_cast<std::int64_t>(place) : names[place];
  }
  [[nodiscard]] std::span<const NodeId> nodes_of(std::size_t element) const {
    const auto width = static_cast<std::size_t>(element_shape(type).node_count);
    return {nodes + element * width, width};
  }
};

template <class Real>
ElementMeasure measure_in(const ElementRun<Real>& run, std::size_t element,
                          const SurfaceOrientation& orientation) {
  std::array<Vec3d, 8> corners;
  std::size_t n = 0;
  for (const NodeId node : run.nodes_of(element)) {
    corners[n++] = vec3_cast<double>(run.positions[node]);
  }
  return measure_element(run.type, corners.data(), orientation.reference(run.first_id + element));
}

template <class Real>
void tally_run(const ElementRun<Real>& run, const SurfaceOrientation& orientation, Tally& tally,
               ChunkSums& sums) {
  for (std::size_t e = run.begin; e < run.end; ++e) {
    tally.add(measure_in(run, e, orientation), run.type, run.id_of(e), sums);
  }
}

/// The mesh cut into runs of at most kChunk elements.
template <class Real>
std::vector<ElementRun<Real>> cut_into_runs(const TopologyView& topology,
                                            std::span<const Vec3<Real>> positions,
                                            std::span<const std::uint32_t> element_ids) {
  std::vector<ElementRun<Real>> runs;
  std::size_t first_id = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t count = block.element_count();
    for (std::size_t begin = 0; begin < count; begin += kChunk) {
      runs.push_back({block.type, block.nodes.data(), begin, std::min(begin + kChunk, count),
                      first_id, positions.data(), element_ids.data()});
    }
    first_id += count;
  }
  return runs;
}

MetricStats summarize(std::size_t m, const Tally& tally, std::int64_t count, double sum) {
  const MetricScale& scale = kScales[m];
  MetricStats stats{.metric = static_cast<QualityMetric>(m),
                    .element_count = count,
                    .min = tally.min[m],
                    .mean = sum / static_cast<double>(count),
                    .max = tally.max[m],
                    .histogram_lower = scale.lower,
                    .histogram_upper = scale.upper,
                    .histogram = std::vector<std::int64_t>(kHistogramSize, 0)};
  for (std::size_t b = 0; b < kBinCount; ++b) {
    stats.histogram[b / (kBinCount / kHistogramSize)] += tally.bins[m][b];
  }
  // The highest edge below which lies at most 1 %; never below the least value.
  std::int64_t below = 0;
  std::size_t bin = 0;
  while (100 * (below + tally.bins[m][bin]) <= count) below += tally.bins[m][bin++];
  stats.percentile_1 =
      std::max(stats.min,
               scale.lower + (scale.upper - scale.lower) * (static_cast<double>(bin) / kBinCount));
  return stats;
}

template <class Real>
QualityStats measure_runs(const std::vector<ElementRun<Real>>& runs,
                          const SurfaceOrientation& orientation) {
  std::vector<ChunkSums> chunk_sums(runs.size());
  tbb::enumerable_thread_specific<Tally> tallies;
  tbb::parallel_for(std::size_t{0}, runs.size(), [&](std::size_t r) {
    tally_run(runs[r], orientation, tallies.local(), chunk_sums[r]);
  });

  Tally total;
  for (const Tally& tally : tallies) total.merge(tally);
  ChunkSums sums;
  for (const ChunkSums& chunk : chunk_sums) {
    for (std::size_t m = 0; m < kMetricCount; ++m) sums.values[m] += chunk.values[m];
    sums.volume += chunk.volume;
  }
  QualityStats stats;
  for (const ElementRun<Real>& run : runs) {
    stats.element_count += static_cast<std::int64_t>(run.end - run.begin);
  }
  stats.inverted_count = total.inverted;
  stats.degenerate_count = total.degenerate;
  stats.sum_absolute_volume = sums.volume;
  for (std::size_t m = 0; m < kMetricCount; ++m) {
    std::int64_t count = 0;
    for (const std::int64_t in_bin : total.bins[m]) count += in_bin;
    if (count > 0) stats.metrics.push_back(summarize(m, total, count, sums.values[m]));
  }
  std::sort(total.worst.begin(), total.worst.end(), worse);
  stats.worst = std::move(total.worst);
  return stats;
}

}  // namespace

std::string_view metric_name(QualityMetric metric) {
  return kScales[static_cast<std::size_t>(metric)].name;
}

QualityStats measure_quality(const TopologyView& topology, const PositionsView& positions,
                             const SurfaceOrientation& orientation,
                             std::span<const std::uint32_t> element_ids) {
  return std::visit(
      [&](auto span) {
        return measure_runs(cut_into_runs(topology, span, element_ids), orientation);
      },
      positions);
}

QualityStats measure_quality(const Mesh& mesh) {
  const MeshTopology topology(mesh);
  const PositionsView positions = mesh.positions_view();
  return measure_quality(topology.view(), positions,
                         SurfaceOrientation(topology.view(), positions));
}

LockedStats measure_locked(const TopologyView& topology, std::span<const std::uint8_t> fixed,
                           const PositionsView& positions, const SurfaceOrientation& orientation,
                           std::span<const std::uint32_t> element_ids) {
  const auto measure_all = [&]<class Real>(std::span<const Vec3<Real>> span) {
    const std::vector<ElementRun<Real>> runs = cut_into_runs(topology, span, element_ids);
    tbb::enumerable_thread_specific<LockedStats> per_thread;
    const auto merge = [](LockedStats& into, const LockedStats& from) {
      into.element_count += from.element_count;
      into.inverted_count += from.inverted_count;
      if (from.worst && (!into.worst || worse(*from.worst, *into.worst))) into.worst = from.worst;
    };
    tbb::parallel_for(std::size_t{0}, runs.size(), [&](std::size_t r) {
      const ElementRun<Real>& run = runs[r];
      for (std::size_t e = run.begin; e < run.end; ++e) {
        const auto nodes = run.nodes_of(e);
        if (!std::ranges::all_of(nodes, [&](NodeId n) { return fixed[n] != 0; })) continue;
        const ElementMeasure measure = measure_in(run, e, orientation);
        merge(per_thread.local(),
              {.element_count = 1,
               .inverted_count = measure.inverted ? 1 : 0,
               .worst = ElementQuality{run.id_of(e), run.type, measure.mean_ratio,
                                       measure.scaled_jacobian}});
      }
    });
    LockedStats total;
    for (const LockedStats& stats : per_thread) merge(total, stats);
    return total;
  };
  return std::visit(measure_all, positions);
}

}  // namespace meshsmooth

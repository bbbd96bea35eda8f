// Evaluates all elements of a mesh in one pass.

#include "meshsmooth/quality.hpp"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <utility>

#include "mesh/accumulator.hpp"
#include "mesh/curved_jacobian.hpp"
#include "mesh/measure.hpp"
#include "mesh/measure_batch.hpp"
#include "mesh/metric_columns.hpp"
#include "mesh/parallel.hpp"
#include "mesh/spread.hpp"
#include "meshsmooth/canonical_topology.hpp"

namespace meshsmooth {
namespace {

using namespace detail;

/// Sums are formed by chunk and added in order: the same bits for any number of threads.
constexpr std::size_t kChunk = 8192;
constexpr std::size_t kSecondOrderChunk = 256;  // curved elements cost more, and lie together

/// A run of elements of one type.
template <class Real>
struct ElementRun {
  ElementType type;
  const NodeId* nodes;
  std::size_t begin, end;  // inside the block
  std::size_t first_id;    // of the block
  std::span<const Vec3<Real>> positions;
  const std::uint32_t* names;  // of all elements, or null
  std::size_t width = element_width(type);

  [[nodiscard]] std::int64_t id_of(std::size_t element) const {
    const std::size_t index = first_id + element;
    return names == nullptr ? static_cast<std::int64_t>(index) : names[index];
  }
  [[nodiscard]] std::span<const NodeId> nodes_of(std::size_t element) const {
    return {nodes + element * width, width};
  }
};

template <class Real>
ElementMeasure measure_in(const ElementRun<Real>& run, std::size_t element,
                          const SurfaceOrientation& orientation) {
  const std::array<Vec3d, kMaxElementNodes> positions =
      detail::positions_of(run.nodes_of(element), run.positions);
  return detail::measure_nodes(run.type, positions.data(),
                               orientation.reference(run.first_id + element));
}

/// Calls `take(first, count, batch)` for the tetrahedra of a run, in batches.
template <class Real, class Take>
void for_each_batch(const ElementRun<Real>& run, const Take& take) {
  TetrahedronBatch batch{};
  for (std::size_t first = run.begin; first < run.end; first += TetrahedronBatch::kSize) {
    const int count =
        static_cast<int>(std::min<std::size_t>(TetrahedronBatch::kSize, run.end - first));
    for (int t = 0; t < count; ++t) {
      batch.set(t, run.positions, run.nodes_of(first + static_cast<std::size_t>(t)).data());
    }
    take(first, count, batch);
  }
}

/// `take(element, measure)` for every element of a run.
template <class Real, class Take>
void measure_run(const ElementRun<Real>& run, const SurfaceOrientation& orientation,
                 const Take& take) {
  if (run.type != ElementType::tetrahedron) {
    for (std::size_t e = run.begin; e < run.end; ++e) take(e, measure_in(run, e, orientation));
    return;
  }
  for_each_batch(run, [&](std::size_t first, int count, const TetrahedronBatch& batch) {
    const auto measures = measure_tetrahedra(batch);
    for (int t = 0; t < count; ++t) take(first + static_cast<std::size_t>(t), measures[t]);
  });
}

template <class Real>
void accumulate_run(const ElementRun<Real>& run, const SurfaceOrientation& orientation,
                    QualityAccumulator& accumulate, ChunkSums& sums) {
  measure_run(run, orientation, [&](std::size_t e, const ElementMeasure& measure) {
    accumulate.add(measure, run.type, run.id_of(e), sums);
  });
}

template <class Real>
void accumulate_run(const ElementRun<Real>& run, const SurfaceOrientation& orientation,
                    BriefAccumulator& accumulate, ChunkSums& sums) {
  const auto add = [&](std::size_t e) {
    accumulate.add_briefly(measure_in(run, e, orientation), run.type, run.id_of(e), sums);
  };
  if (run.type != ElementType::tetrahedron) {
    for (std::size_t e = run.begin; e < run.end; ++e) add(e);
    return;
  }
  for_each_batch(run, [&](std::size_t first, int count, const TetrahedronBatch& batch) {
    const ClearTetrahedra found = find_clear(batch, accumulate.cube_below_which_kept());
    for (int t = 0; t < count; ++t) {
      if (found.clear(t)) {
        sums.volume += found.volume(t);
        sums.enclosed_volume += found.volume(t);
      } else {
        add(first + static_cast<std::size_t>(t));
      }
    }
  });
}

/// The mesh cut into runs of at most a chunk of elements.
template <class Real>
std::vector<ElementRun<Real>> cut_into_runs(const TopologyView& topology,
                                            std::span<const Vec3<Real>> positions,
                                            std::span<const std::uint32_t> element_ids) {
  std::vector<ElementRun<Real>> runs;
  std::size_t first_id = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t count = block.element_count();
    const std::size_t chunk = is_second_order(block.type) ? kSecondOrderChunk : kChunk;
    for (std::size_t begin = 0; begin < count; begin += chunk) {
      runs.push_back({block.type, block.nodes.data(), begin, std::min(begin + chunk, count),
                      first_id, positions, element_ids.data()});
    }
    first_id += count;
  }
  return runs;
}

template <class Accumulator, class Real>
QualityStats measure_runs(const std::vector<ElementRun<Real>>& runs,
                          const SurfaceOrientation& orientation) {
  std::vector<ChunkSums> chunk_sums(runs.size());
  tbb::enumerable_thread_specific<Accumulator> accumulators;
  parallel_for(runs.size(), [&](std::size_t index) {
    const std::size_t r = spread(index, runs.size());
    accumulate_run(runs[r], orientation, accumulators.local(), chunk_sums[r]);
  });

  Accumulator total;
  for (const Accumulator& accumulate : accumulators) total.merge(accumulate);
  ChunkSums sums;
  for (const ChunkSums& chunk : chunk_sums) {
    for (std::size_t m = 0; m < kMetricCount; ++m) sums.values[m] += chunk.values[m];
    sums.volume += chunk.volume;
    sums.enclosed_volume += chunk.enclosed_volume;
  }
  std::int64_t element_count = 0;
  for (const ElementRun<Real>& run : runs) {
    element_count += static_cast<std::int64_t>(run.end - run.begin);
  }
  return summarize(total, sums, element_count);
}

}  // namespace

ElementMeasure measure_element(ElementType type, const Vec3d* nodes, Vec3d reference) {
  return detail::measure_nodes(type, nodes, reference);
}

std::string_view metric_name(QualityMetric metric) { return enum_name(metric); }

std::optional<QualityMetric> find_metric(std::string_view name) {
  const auto* const found = std::ranges::find(kQualityMetrics, name, metric_name);
  if (found == kQualityMetrics.end()) return std::nullopt;
  return *found;
}

bool has_metric(ElementType type, QualityMetric metric) {
  const MetricsOfType own = metrics_of(element_shape(type));
  const auto* const end = own.metrics + own.count;
  return std::find(own.metrics, end, static_cast<int>(metric)) != end;
}

QualityStats measure_quality(const TopologyView& topology, const PositionsView& positions,
                             const SurfaceOrientation& orientation,
                             std::span<const std::uint32_t> element_ids,
                             QualityDetail quality_detail) {
  return std::visit(
      [&](auto span) {
        const auto runs = cut_into_runs(topology, span, element_ids);
        return quality_detail == QualityDetail::brief
                   ? measure_runs<BriefAccumulator>(runs, orientation)
                   : measure_runs<QualityAccumulator>(runs, orientation);
      },
      positions);
}

QualityStats measure_quality(const Mesh& mesh) {
  const MeshTopology topology(mesh);
  const PositionsView positions = mesh.positions_view();
  const SurfaceOrientation orientation(topology.view(), positions);
  QualityStats stats = measure_quality(topology.view(), positions, orientation);
  // What is not canonical is inverted or degenerate; on a curved surface nothing is against its own
  // normal.
  const bool plain =
      stats.inverted_count + stats.degenerate_count == 0 && orientation.normals().empty();
  if (plain) return stats;
  const CanonicalTopology canonical(topology.view(), positions);
  if (!canonical.changed()) return stats;
  stats =
      measure_quality(canonical.view(), positions, SurfaceOrientation(canonical.view(), positions));
  canonical.complete(stats);
  return stats;
}

ElementQualityArrays measure_elements(const TopologyView& topology, const PositionsView& positions,
                                      const SurfaceOrientation& orientation,
                                      std::vector<QualityMetric> metrics,
                                      std::span<const std::uint32_t> element_ids) {
  const std::size_t element_count = topology.element_count();
  ElementQualityArrays result{std::move(metrics), {}};
  result.values.resize(result.metrics.size() * element_count);
  const MetricColumns columns(result.metrics, result.values.data(), element_count);
  const auto measure_all = [&]<class Real>(std::span<const Vec3<Real>> span) {
    const std::vector<ElementRun<Real>> runs = cut_into_runs(topology, span, element_ids);
    parallel_for(runs.size(), [&](std::size_t r) {
      const ElementRun<Real>& run = runs[r];
      measure_run(run, orientation, [&](std::size_t e, const ElementMeasure& measure) {
        columns.store(element_shape(run.type), measure, static_cast<std::size_t>(run.id_of(e)));
      });
    });
  };
  std::visit(measure_all, positions);
  return result;
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
    parallel_for(runs.size(), [&](std::size_t r) {
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

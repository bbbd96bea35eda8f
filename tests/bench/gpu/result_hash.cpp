#include "gpu/result_hash.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "wire/sha256.hpp"

namespace meshsmooth::bench {
namespace {

/// A hash of values, each by its bits.
class Hash {
 public:
  template <class T>
  requires std::is_arithmetic_v<T> Hash& add(T value) {
    sha_.add(std::as_bytes(std::span(&value, 1)));
    return *this;
  }
  template <class T>
  Hash& add_array(const std::vector<T>& values) {
    add(std::uint64_t{values.size()});
    sha_.add(std::as_bytes(std::span(values)));
    return *this;
  }
  Hash& add_text(std::string_view text) {
    add(std::uint64_t{text.size()});
    sha_.add(std::as_bytes(std::span(text)));
    return *this;
  }
  [[nodiscard]] std::string finish() { return sha_.finish(); }

 private:
  wire::Sha256 sha_;
};

void add(Hash& hash, const Convergence& c) {
  hash.add(c.iteration_count).add(c.last_max_displacement).add(c.last_rms_displacement);
  hash.add(c.tolerance).add(c.bounding_box_diagonal).add(c.held_node_count);
  hash.add_array(c.max_displacements).add_array(c.rms_displacements);
  hash.add_array(c.moved_node_counts).add_array(c.energies).add_array(c.worst_mean_ratios);
}

void add(Hash& hash, const ElementQuality& element) {
  hash.add(element.element).add_text(element_name(element.type));
  hash.add(element.mean_ratio).add(element.scaled_jacobian);
}

void add(Hash& hash, const QualityStats& quality) {
  hash.add(quality.element_count).add(quality.inverted_count).add(quality.degenerate_count);
  hash.add(quality.sum_absolute_volume).add(quality.enclosed_volume);
  for (const MetricStats& m : quality.metrics) {
    hash.add_text(metric_name(m.metric)).add(m.element_count);
    hash.add(m.min).add(m.percentile_1).add(m.mean).add(m.max);
    hash.add(m.histogram_lower).add(m.histogram_upper).add_array(m.histogram);
  }
  for (const ElementQuality& element : quality.worst) add(hash, element);
}

void add(Hash& hash, const NodeCounts& n) {
  for (const std::int64_t count :
       {n.total, n.boundary, n.fixed, n.isolated, n.moved, n.between_regions, n.sliding_in_plane,
        n.sliding_on_line, n.curved, n.sliding_on_surface, n.sliding_on_curve}) {
    hash.add(count);
  }
}

void add_positions(Hash& hash, const Mesh& mesh) {
  std::visit([&](const auto& positions) { hash.add_array(positions); }, mesh.positions);
}

}  // namespace

std::string positions_hash(const Mesh& mesh) {
  Hash hash;
  add_positions(hash, mesh);
  return hash.finish();
}

std::string mesh_hash(const Mesh& mesh) {
  Hash hash;
  add_positions(hash, mesh);
  for (const ElementBlock& block : mesh.blocks) {
    hash.add_text(element_name(block.type)).add_array(block.nodes);
  }
  return hash.add_array(mesh.fixed).add_array(mesh.regions).finish();
}

std::string quality_hash(const SmoothSummary& summary) {
  Hash hash;
  add(hash, summary.quality_before);
  add(hash, summary.quality_after);
  hash.add(summary.locked.element_count).add(summary.locked.inverted_count);
  if (summary.locked.worst) add(hash, *summary.locked.worst);
  return hash.finish();
}

std::string course_hash(const SmoothSummary& summary) {
  Hash hash;
  hash.add_text(stop_reason_name(summary.stop_reason));
  add(hash, summary.convergence);
  add(hash, summary.nodes);
  const BoundaryDeviation& deviation = summary.deviation;
  hash.add(deviation.tolerance).add(deviation.result_to_input).add(deviation.input_to_result);
  return hash.add(summary.colour_count).finish();
}

const char* stop_reason_name(StopReason reason) {
  switch (reason) {
    case StopReason::converged:
      return "converged";
    case StopReason::target_reached:
      return "target_reached";
    case StopReason::iteration_limit:
      return "iteration_limit";
    case StopReason::compute_budget:
      return "compute_budget";
    case StopReason::stagnated:
      return "stagnated";
    case StopReason::cancelled_with_result:
      return "cancelled_with_result";
  }
  return "?";
}

}  // namespace meshsmooth::bench

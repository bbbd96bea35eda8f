#include "wire/quality_codec.hpp"

#include "wire/codec.hpp"

namespace meshsmooth::wire {
namespace {

void encode_metric_stats(const MetricStats& stats, v1::MetricStats* message) {
  message->set_metric(encode_enum(stats.metric));
  message->set_element_count(stats.element_count);
  message->set_min(stats.min);
  message->set_percentile_1(stats.percentile_1);
  message->set_mean(stats.mean);
  message->set_max(stats.max);
  message->set_histogram_lower(stats.histogram_lower);
  message->set_histogram_upper(stats.histogram_upper);
  message->mutable_histogram()->Assign(stats.histogram.begin(), stats.histogram.end());
}

MetricStats decode_metric_stats(const v1::MetricStats& message) {
  return {.metric = *decode_enum<QualityMetric>(message.metric()),
          .element_count = message.element_count(),
          .min = message.min(),
          .percentile_1 = message.percentile_1(),
          .mean = message.mean(),
          .max = message.max(),
          .histogram_lower = message.histogram_lower(),
          .histogram_upper = message.histogram_upper(),
          .histogram = {message.histogram().begin(), message.histogram().end()}};
}

}  // namespace

void encode_element_quality(const ElementQuality& quality, v1::ElementQuality* message) {
  message->set_element(quality.element);
  message->set_element_type(encode_element_type(quality.type));
  message->set_mean_ratio(quality.mean_ratio);
  message->set_scaled_jacobian(quality.scaled_jacobian);
}

ElementQuality decode_element_quality(const v1::ElementQuality& message) {
  return {.element = message.element(),
          .type = decode_element_type(message.element_type(), "element_type"),
          .mean_ratio = message.mean_ratio(),
          .scaled_jacobian = message.scaled_jacobian()};
}

void encode_quality(const QualityStats& stats, v1::QualityStats* message) {
  message->set_element_count(stats.element_count);
  message->set_inverted_element_count(stats.inverted_count);
  message->set_degenerate_element_count(stats.degenerate_count);
  message->set_sum_absolute_volume(stats.sum_absolute_volume);
  message->set_enclosed_volume(stats.enclosed_volume);
  message->set_mirrored_element_count(stats.mirrored_count);
  for (const std::int64_t element : stats.mirrored) message->add_mirrored_elements(element);
  message->set_collapsed_element_count(stats.collapsed_count);
  message->set_interface_element_count(stats.interface_count);
  for (const MetricStats& metric : stats.metrics) {
    encode_metric_stats(metric, message->add_metrics());
  }
  for (const ElementQuality& element : stats.worst) {
    encode_element_quality(element, message->add_worst_elements());
  }
}

QualityStats decode_quality(const v1::QualityStats& message) {
  QualityStats stats;
  stats.element_count = message.element_count();
  stats.inverted_count = message.inverted_element_count();
  stats.degenerate_count = message.degenerate_element_count();
  stats.sum_absolute_volume = message.sum_absolute_volume();
  stats.enclosed_volume = message.enclosed_volume();
  stats.mirrored_count = message.mirrored_element_count();
  stats.mirrored.assign(message.mirrored_elements().begin(), message.mirrored_elements().end());
  stats.collapsed_count = message.collapsed_element_count();
  stats.interface_count = message.interface_element_count();
  for (const v1::MetricStats& metric : message.metrics()) {
    if (!decode_enum<QualityMetric>(metric.metric())) {
      continue;
    }
    stats.metrics.push_back(decode_metric_stats(metric));
  }
  for (const v1::ElementQuality& element : message.worst_elements()) {
    stats.worst.push_back(decode_element_quality(element));
  }
  return stats;
}

}  // namespace meshsmooth::wire

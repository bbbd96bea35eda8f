// The half of codec.hpp that concerns SmoothSummary.
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"
#include "wire/codec.hpp"
#include "wire/fit_codec.hpp"
#include "wire/quality_codec.hpp"

namespace meshsmooth::wire {
namespace {

template <class Values, class Repeated>
void copy_all(const Values& values, Repeated* repeated) {
  repeated->Assign(values.begin(), values.end());
}

StopReason decode_stop_reason(v1::StopReason reason) {
  if (const auto known = decode_enum<StopReason>(reason)) return *known;
  throw NotSupported(
      "RESPONSE_NOT_UNDERSTOOD",
      "the server named a stop reason that this client does not know: " + std::to_string(reason));
}

EndRule decode_end_rule(v1::EndRule rule) {
  return decode_enum<EndRule>(rule).value_or(EndRule::none);
}

void encode_convergence(const Convergence& convergence, v1::ConvergenceStats* message) {
  message->set_iteration_count(convergence.iteration_count);
  message->set_end_rule(encode_enum(convergence.end_rule));
  if (convergence.remaining_gain) message->set_remaining_gain(*convergence.remaining_gain);
  message->set_last_max_displacement(convergence.last_max_displacement);
  message->set_last_rms_displacement(convergence.last_rms_displacement);
  message->set_tolerance(convergence.tolerance);
  message->set_bounding_box_diagonal(convergence.bounding_box_diagonal);
  message->set_held_node_count(convergence.held_node_count);
  copy_all(convergence.max_displacements, message->mutable_max_displacements());
  copy_all(convergence.rms_displacements, message->mutable_rms_displacements());
  copy_all(convergence.moved_node_counts, message->mutable_moved_node_counts());
  copy_all(convergence.energies, message->mutable_energies());
  copy_all(convergence.worst_mean_ratios, message->mutable_worst_mean_ratios());
}

Convergence decode_convergence(const v1::ConvergenceStats& message) {
  return {
      .iteration_count = message.iteration_count(),
      .end_rule = decode_end_rule(message.end_rule()),
      .remaining_gain =
          message.has_remaining_gain() ? std::optional(message.remaining_gain()) : std::nullopt,
      .last_max_displacement = message.last_max_displacement(),
      .last_rms_displacement = message.last_rms_displacement(),
      .tolerance = message.tolerance(),
      .bounding_box_diagonal = message.bounding_box_diagonal(),
      .held_node_count = message.held_node_count(),
      .max_displacements = {message.max_displacements().begin(), message.max_displacements().end()},
      .rms_displacements = {message.rms_displacements().begin(), message.rms_displacements().end()},
      .moved_node_counts = {message.moved_node_counts().begin(), message.moved_node_counts().end()},
      .energies = {message.energies().begin(), message.energies().end()},
      .worst_mean_ratios = {message.worst_mean_ratios().begin(),
                            message.worst_mean_ratios().end()}};
}

void encode_times(const StageTimes& times, v1::Timings* message) {
  *message->mutable_upload() = encode_seconds(times.upload_seconds);
  *message->mutable_find_neighbours() = encode_seconds(times.find_neighbours_seconds);
  *message->mutable_find_boundary() = encode_seconds(times.find_boundary_seconds);
  *message->mutable_iterate() = encode_seconds(times.iterate_seconds);
  *message->mutable_evaluate() = encode_seconds(times.evaluate_seconds);
  *message->mutable_download() = encode_seconds(times.download_seconds);
}

StageTimes decode_times(const v1::Timings& message) {
  return {.upload_seconds = decode_seconds(message.upload()),
          .find_neighbours_seconds = decode_seconds(message.find_neighbours()),
          .find_boundary_seconds = decode_seconds(message.find_boundary()),
          .iterate_seconds = decode_seconds(message.iterate()),
          .evaluate_seconds = decode_seconds(message.evaluate()),
          .download_seconds = decode_seconds(message.download())};
}

void encode_backend(const std::string& backend, v1::Execution* message) {
  const auto name = parse_backend_name(backend);
  if (!name) return;
  message->set_backend_kind(encode_enum(name->kind));
  if (name->device) message->set_device_index(*name->device);
}

std::string decode_backend(const v1::Execution& message) {
  if (message.backend_kind() == v1::BACKEND_KIND_UNSPECIFIED ||
      !v1::BackendKind_IsValid(message.backend_kind())) {
    return "";
  }
  BackendName name{.kind = static_cast<BackendKind>(message.backend_kind())};
  if (has_devices(name.kind)) name.device = message.device_index();
  return to_string(name);
}

void encode_motion(const MotionStats& motion, v1::MotionStats* message) {
  message->set_reached(motion.reached);
  message->set_step_count(motion.step_count);
  message->set_rejected_step_count(motion.rejected_step_count);
  message->set_linear_iteration_count(motion.linear_iteration_count);
  message->set_linear_residual(motion.linear_residual);
  *message->mutable_linear_time() = encode_seconds(motion.linear_seconds);
  message->set_blocking_element_count(motion.blocking_element_count);
  message->mutable_blocking_elements()->Assign(motion.blocking_elements.begin(),
                                               motion.blocking_elements.end());
}

MotionStats decode_motion(const v1::MotionStats& message) {
  return {.reached = message.reached(),
          .step_count = message.step_count(),
          .rejected_step_count = message.rejected_step_count(),
          .linear_iteration_count = message.linear_iteration_count(),
          .linear_residual = message.linear_residual(),
          .linear_seconds = decode_seconds(message.linear_time()),
          .blocking_element_count = message.blocking_element_count(),
          .blocking_elements = {message.blocking_elements().begin(),
                                message.blocking_elements().end()}};
}

void encode_kept_quality(const KeptQuality& kept, v1::KeptQuality* message) {
  message->set_metric(encode_enum(kept.metric));
  message->set_for_mean_ratio(kept.for_mean_ratio);
  message->set_for_scaled_jacobian(kept.for_scaled_jacobian);
  message->set_for_mean(kept.for_mean);
}

KeptQuality decode_kept_quality(const v1::KeptQuality& message) {
  const bool ratio = message.metric() != v1::QUALITY_METRIC_SCALED_JACOBIAN;
  return {.metric = ratio ? QualityMetric::mean_ratio : QualityMetric::scaled_jacobian,
          .for_mean_ratio = message.for_mean_ratio(),
          .for_scaled_jacobian = message.for_scaled_jacobian(),
          .for_mean = message.for_mean()};
}

}  // namespace

v1::Summary encode_summary(const SmoothSummary& summary) {
  v1::Summary message;
  message.set_stop_reason(encode_enum(summary.stop_reason));
  encode_convergence(summary.convergence, message.mutable_convergence());
  encode_quality(summary.quality_before, message.mutable_quality_before());
  encode_quality(summary.quality_after, message.mutable_quality_after());

  v1::LockedStats* locked = message.mutable_locked();
  locked->set_element_count(summary.locked.element_count);
  locked->set_inverted_element_count(summary.locked.inverted_count);
  if (summary.locked.worst) {
    encode_element_quality(*summary.locked.worst, locked->mutable_worst_element());
  }

  if (summary.poor) {
    v1::PoorElements* poor = message.mutable_poor();
    poor->set_below(summary.poor->below);
    poor->set_element_count(summary.poor->element_count);
    poor->set_locked_count(summary.poor->locked_count);
    poor->set_limited_count(summary.poor->limited_count);
  }

  if (summary.motion) encode_motion(*summary.motion, message.mutable_motion());
  if (summary.fit) encode_fit(*summary.fit, message.mutable_fit());
  if (summary.kept_quality) {
    encode_kept_quality(*summary.kept_quality, message.mutable_kept_quality());
  }

  v1::NodeCounts* nodes = message.mutable_nodes();
  nodes->set_total(summary.nodes.total);
  nodes->set_boundary(summary.nodes.boundary);
  nodes->set_fixed(summary.nodes.fixed);
  nodes->set_isolated(summary.nodes.isolated);
  nodes->set_moved(summary.nodes.moved);
  nodes->set_between_regions(summary.nodes.between_regions);
  nodes->set_outside_only_below(summary.nodes.outside_only_below);
  nodes->set_coincident(summary.nodes.coincident);
  nodes->set_paired(summary.nodes.paired);
  nodes->set_sliding_in_plane(summary.nodes.sliding_in_plane);
  nodes->set_sliding_on_line(summary.nodes.sliding_on_line);
  nodes->set_curved(summary.nodes.curved);
  nodes->set_sliding_on_surface(summary.nodes.sliding_on_surface);
  nodes->set_sliding_on_curve(summary.nodes.sliding_on_curve);
  nodes->set_on_non_manifold_edges(summary.nodes.on_non_manifold_edges);

  message.set_flat_reference_element_count(summary.flat_reference_element_count);
  if (summary.deviation.tolerance > 0) {
    v1::BoundaryDeviation* deviation = message.mutable_boundary_deviation();
    deviation->set_tolerance(summary.deviation.tolerance);
    deviation->set_result_to_input(summary.deviation.result_to_input);
    deviation->set_input_to_result(summary.deviation.input_to_result);
  }

  encode_times(summary.times, message.mutable_timings());

  v1::Execution* execution = message.mutable_execution();
  encode_backend(summary.backend, execution);
  execution->set_device_name(summary.device_name);
  execution->set_host_peak_bytes(summary.host_peak_bytes);
  execution->set_device_peak_bytes(summary.device_peak_bytes);
  execution->set_thread_count(summary.thread_count);
  execution->set_colour_count(summary.colour_count);
  return message;
}

SmoothSummary decode_summary(const v1::Summary& message) {
  SmoothSummary summary;
  summary.stop_reason = decode_stop_reason(message.stop_reason());
  summary.convergence = decode_convergence(message.convergence());
  summary.quality_before = decode_quality(message.quality_before());
  summary.quality_after = decode_quality(message.quality_after());
  summary.locked = {.element_count = message.locked().element_count(),
                    .inverted_count = message.locked().inverted_element_count(),
                    .worst = {}};
  if (message.has_poor()) {
    summary.poor = {.below = message.poor().below(),
                    .element_count = message.poor().element_count(),
                    .locked_count = message.poor().locked_count(),
                    .limited_count = message.poor().limited_count()};
  }
  if (message.has_motion()) summary.motion = decode_motion(message.motion());
  if (message.has_fit()) summary.fit = decode_fit(message.fit());
  if (message.has_kept_quality()) {
    summary.kept_quality = decode_kept_quality(message.kept_quality());
  }
  if (message.locked().has_worst_element()) {
    summary.locked.worst = decode_element_quality(message.locked().worst_element());
  }
  summary.nodes = {.total = message.nodes().total(),
                   .boundary = message.nodes().boundary(),
                   .fixed = message.nodes().fixed(),
                   .isolated = message.nodes().isolated(),
                   .moved = message.nodes().moved(),
                   .between_regions = message.nodes().between_regions(),
                   .outside_only_below = message.nodes().outside_only_below(),
                   .coincident = message.nodes().coincident(),
                   .paired = message.nodes().paired(),
                   .sliding_in_plane = message.nodes().sliding_in_plane(),
                   .sliding_on_line = message.nodes().sliding_on_line(),
                   .curved = message.nodes().curved(),
                   .sliding_on_surface = message.nodes().sliding_on_surface(),
                   .sliding_on_curve = message.nodes().sliding_on_curve(),
                   .on_non_manifold_edges = message.nodes().on_non_manifold_edges()};
  summary.flat_reference_element_count = message.flat_reference_element_count();
  summary.deviation = {.tolerance = message.boundary_deviation().tolerance(),
                       .result_to_input = message.boundary_deviation().result_to_input(),
                       .input_to_result = message.boundary_deviation().input_to_result()};
  summary.times = decode_times(message.timings());
  const v1::Execution& execution = message.execution();
  summary.backend = decode_backend(execution);
  summary.device_name = execution.device_name();
  summary.thread_count = execution.thread_count();
  summary.colour_count = execution.colour_count();
  summary.host_peak_bytes = execution.host_peak_bytes();
  summary.device_peak_bytes = execution.device_peak_bytes();
  return summary;
}

}  // namespace meshsmooth::wire

#include "wire/fit_codec.hpp"

namespace meshsmooth::wire {
namespace {

void encode_distance(const SurfaceDistance& distance, v1::SurfaceDistance* message) {
  message->set_largest(distance.largest);
  message->set_mean(distance.mean);
}
SurfaceDistance decode_distance(const v1::SurfaceDistance& message) {
  return {message.largest(), message.mean()};
}

void encode_surface_counts(const SurfaceCounts& counts, v1::SurfaceCounts* message) {
  message->set_triangle_count(counts.triangles);
  message->set_patch_count(counts.patches);
  message->set_curve_count(counts.curves);
  message->set_corner_count(counts.corners);
  message->set_open_edge_count(counts.open_edges);
  message->set_non_manifold_edge_count(counts.non_manifold_edges);
  message->set_degenerate_triangle_count(counts.degenerate_triangles);
}
SurfaceCounts decode_surface_counts(const v1::SurfaceCounts& message) {
  return {.triangles = message.triangle_count(),
          .patches = message.patch_count(),
          .curves = message.curve_count(),
          .corners = message.corner_count(),
          .open_edges = message.open_edge_count(),
          .non_manifold_edges = message.non_manifold_edge_count(),
          .degenerate_triangles = message.degenerate_triangle_count()};
}

}  // namespace

void encode_fit(const FitStats& fit, v1::FitStats* message) {
  encode_surface_counts(fit.surface, message->mutable_surface());
  message->set_node_count(fit.node_count);
  message->set_reached_count(fit.reached_count);
  message->set_held_count(fit.held_count);
  message->set_fixed_count(fit.fixed_count);
  message->set_unmatched_corner_count(fit.unmatched_corner_count);
  message->set_unmatched_curve_count(fit.unmatched_curve_count);
  message->set_step_count(fit.step_count);
  message->set_input_off_surface(fit.input_off_surface);
  encode_distance(fit.input_to_surface, message->mutable_input_to_surface());
  encode_distance(fit.result_to_surface, message->mutable_result_to_surface());
  encode_distance(fit.surface_to_result, message->mutable_surface_to_result());
  for (const TargetPart& part : fit.parts) {
    v1::TargetPart* own = message->add_parts();
    own->set_curve(part.curve);
    own->set_node_count(part.node_count);
    encode_distance(part.distance, own->mutable_distance());
  }
}

FitStats decode_fit(const v1::FitStats& message) {
  FitStats fit{.surface = decode_surface_counts(message.surface()),
               .node_count = message.node_count(),
               .reached_count = message.reached_count(),
               .held_count = message.held_count(),
               .fixed_count = message.fixed_count(),
               .unmatched_corner_count = message.unmatched_corner_count(),
               .unmatched_curve_count = message.unmatched_curve_count(),
               .step_count = message.step_count(),
               .input_off_surface = message.input_off_surface(),
               .input_to_surface = decode_distance(message.input_to_surface()),
               .result_to_surface = decode_distance(message.result_to_surface()),
               .surface_to_result = decode_distance(message.surface_to_result()),
               .parts = {}};
  for (const v1::TargetPart& part : message.parts()) {
    fit.parts.push_back({part.curve(), part.node_count(), decode_distance(part.distance())});
  }
  return fit;
}

}  // namespace meshsmooth::wire

#include "meshsmooth/options.hpp"

#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

#include "meshsmooth/error.hpp"
#include "meshsmooth/input_use.hpp"
#include "meshsmooth/option_table.hpp"

namespace meshsmooth {
namespace {

// Written so that a NaN fails.
void need(bool in_range, const std::string& field, double value, std::string_view range) {
  if (in_range) return;
  std::ostringstream message;
  message << field << " is " << value << ", it must be " << range;
  throw InvalidOption("OPTION_OUT_OF_RANGE", message.str(), {{"field", field}});
}

void need(const OptionRange& allowed, const std::string& field, double value) {
  need(allowed.range.contains(value), field, value, allowed.text);
}

template <class M>
void validate_method(const M& method) {
  for_each_field<M>([&]<class Field>(const Field& field) {
    if constexpr (std::is_same_v<Field, NumberField<M>>) {
      const std::string name(field.name);
      need(field.is_valid(method),
           field.in_options ? name : std::string(MethodTraits<M>::name) + "." + name,
           method.*field.member, field.range_text);
    }
  });
}

template <class M>
void validate_form(const M&, Form form) {
  using Traits = MethodTraits<M>;
  if (form == Form::automatic || std::ranges::find(Traits::forms, form) != Traits::forms.end()) {
    return;
  }
  throw NotSupported("OPTION_NOT_SUPPORTED",
                     std::string(Traits::name) + " " + std::string(Traits::form_reason) +
                         ", it has only the " + std::string(enum_name(Traits::forms.front())) +
                         " form",
                     {{"field", "form"}});
}

void validate_kept_metric(const SmoothOptions& options) {
  if (is_motion(options.method)) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "move keeps no quality, since the boundary moves; it has no metric",
                       {{"field", "metric"}});
  }
  if (*options.metric != QualityMetric::mean_ratio &&
      *options.metric != QualityMetric::scaled_jacobian) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "metric is " + std::string(metric_name(*options.metric)) +
                            ", it must be mean_ratio or scaled_jacobian",
                        {{"field", "metric"}});
  }
  if (!sweeps_as_optimize(options.method) && !(options.never_worse && options.guard)) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "metric is what never_worse keeps with the guard, and what optimize raises; "
                       "the method is " +
                           std::string(method_name(options.method)) + ", without one of those two",
                       {{"field", "metric"}});
  }
}

void validate_only_below(const SmoothOptions& options) {
  if (is_motion(options.method)) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "only_below chooses elements of the input, which move makes follow as a "
                       "whole; use a movement limit or fixed nodes",
                       {{"field", "only_below"}});
  }
  need(option::only_below, "only_below", options.only_below->quality);
  need(option::only_below_rings, "only_below_rings", options.only_below->rings);
}

void validate_report_below(const SmoothOptions& options) {
  need(option::report_below, "report_below", *options.report_below);
  if (sweeps_as_optimize(options.method)) return;
  throw NotSupported(
      "OPTION_NOT_SUPPORTED",
      "only optimize and move tell what holds elements below a quality, the method is " +
          std::string(method_name(options.method)),
      {{"field", "report_below"}});
}

/// Refuses what would promise something that a derivative does not do.
void validate_derivative(const SmoothOptions& options) {
  const auto refuse = [](const char* field, const std::string& why) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "a derivative of move " + why, {{"field", field}});
  };
  if (std::get<Move>(options.method).start == Start::warm) {
    refuse("move.start", "starts cold: it does not depend on earlier jobs");
  }
  if (options.movement_limit) refuse("movement_limit", "has no movement limit");
  if (options.report_below) refuse("report_below", "makes no sweep that could report elements");
  if (!options.element_quality_metrics.empty()) {
    refuse("element_quality_metrics", "has no mesh as its result whose elements it could measure");
  }
}

void validate_reference_of(const SmoothOptions& options) {
  const auto* method = std::get_if<Optimize>(&options.method);
  if (method == nullptr) {
    throw NotSupported(
        "OPTION_NOT_SUPPORTED",
        "only optimize has a reference, the method is " + std::string(method_name(options.method)),
        {{"field", "reference"}});
  }
  if (method->target == Target::ideal || method->target == Target::input) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "optimize.target is " + std::string(enum_name(method->target)) +
                           ", but there is a reference; leave out one of them",
                       {{"field", "optimize.target"}});
  }
}

}  // namespace

bool aims_at_reference(const SmoothOptions& options) {
  const auto* method = std::get_if<Optimize>(&options.method);
  return method != nullptr && method->target == Target::reference;
}

SmoothOptions with_target_of(SmoothOptions options, const JobInput& input) {
  auto* method = std::get_if<Optimize>(&options.method);
  const bool open = method != nullptr && method->target == Target::automatic;
  if (open && position_count(input.reference) > 0) method->target = Target::reference;
  return options;
}

void validate_metrics(std::span<const QualityMetric> metrics) {
  for (auto metric = metrics.begin(); metric != metrics.end(); ++metric) {
    if (std::find(metrics.begin(), metric, *metric) == metric) continue;
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        "element_quality_metrics: " + std::string(metric_name(*metric)) + " is listed twice",
        {{"field", "element_quality_metrics"}});
  }
}

void validate(const SmoothOptions& options) {
  validate_metrics(options.element_quality_metrics);
  std::visit([](const auto& method) { validate_method(method); }, options.method);
  const int limit = iteration_limit(options);
  need(option::iterations, "max_iteration_count", limit);
  if (is_filter(options.method)) {
    need(limit <= kMostFilterIterations, "max_iteration_count", limit,
         "at most " + std::to_string(kMostFilterIterations) + " for windowed_sinc");
  }
  if (options.tolerance.relative) {
    need(option::tolerance, "convergence_tolerance", options.tolerance.value);
  } else {
    need(option::absolute_tolerance, "absolute_tolerance", options.tolerance.value);
  }
  need(option::feature_angle, "feature_angle", options.feature_angle);
  if (options.compute_budget) {
    const double seconds = std::chrono::duration<double>(*options.compute_budget).count();
    need(option::compute_budget, "compute_budget", seconds);
  }
  if (options.movement_limit) {
    need(option::movement_limit,
         options.movement_limit->relative ? "movement_limit" : "absolute_movement_limit",
         options.movement_limit->value);
  }
  if (options.metric) validate_kept_metric(options);
  if (options.only_below) validate_only_below(options);
  if (options.report_below) validate_report_below(options);
  if (derivative_of(options.method) != Derivative::none) validate_derivative(options);
  std::visit([&](const auto& method) { validate_form(method, options.form); }, options.method);
}

void validate_surface_use(const SmoothOptions& options) {
  const auto refuse = [](const std::string& why) {
    throw NotSupported("OPTION_NOT_SUPPORTED", "a target surface " + why, {{"field", "surface"}});
  };
  if (!std::holds_alternative<Optimize>(options.method)) {
    refuse("is for optimize only, the method is " + std::string(method_name(options.method)));
  }
  if (options.boundary != BoundaryPolicy::slide) {
    refuse("needs the boundary policy slide, it is " + std::string(enum_name(options.boundary)));
  }
  if (options.only_below) refuse("cannot be used together with only_below");
  if (std::get<Optimize>(options.method).stay > 0) refuse("cannot be used together with stay");
}

void validate_input_use(const SmoothOptions& options, const JobInput& input) {
  if (position_count(input.reference) > 0) validate_reference_of(options);
  if (input.surface != nullptr) validate_surface_use(options);
  const bool prescribes =
      !input.prescribed.nodes.empty() || position_count(input.prescribed.positions) > 0;
  if (prescribes && !is_motion(options.method)) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "only move takes prescribed nodes, the method is " +
                           std::string(method_name(options.method)),
                       {{"field", "prescribed"}});
  }
  if (position_count(input.cotangent) > 0 &&
      derivative_of(options.method) != Derivative::cotangent) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "only move takes cotangents, with its derivative of that kind",
                       {{"field", "cotangent"}});
  }
}

void validate(const SmoothOptions& options, const JobInput& input) {
  validate(options);
  validate_input_use(options, input);
}

}  // namespace meshsmooth

#include "smooth_options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <map>
#include <ranges>
#include <sstream>
#include <system_error>
#include <vector>

#include "add_flag.hpp"
#include "meshsmooth/error.hpp"
#include "method_flags.hpp"

namespace meshsmooth::cli {
namespace {

/// Enumerators by their words on the command line.
template <class Enum, class Values>
std::map<std::string, Enum> words_of(const Values& values) {
  std::map<std::string, Enum> words;
  for (const Enum value : values) words.emplace(to_word(enum_name(value)), value);
  return words;
}

const std::map<std::string, Form> kForms =
    words_of<Form>(enum_values<Form>() | std::views::drop(1));  // without `automatic`
const std::map<std::string, BoundaryPolicy> kBoundaries =
    words_of<BoundaryPolicy>(enum_values<BoundaryPolicy>());
const std::map<std::string, QualityMetric> kMetrics =
    words_of<QualityMetric>(std::array{QualityMetric::mean_ratio, QualityMetric::scaled_jacobian});
const std::map<std::string, TangledPolicy> kTangled =
    words_of<TangledPolicy>(enum_values<TangledPolicy>());

template <class Value>
std::vector<std::string> names(const std::map<std::string, Value>& values) {
  std::vector<std::string> result;
  for (const auto& [name, value] : values) result.push_back(name);
  return result;
}

/// Of "0.5", a length in the mesh's unit, or "2%" of the bounding box's diagonal.
MovementLimit to_movement_limit(const std::string& text) {
  const bool relative = text.ends_with('%');
  const char* const end = text.data() + text.size() - (relative ? 1 : 0);
  double value = 0;
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end) {
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        "--movement-limit " + text + " is neither a length (0.5) nor a share of the diagonal (2%)",
        {{"field", "--movement-limit"}});
  }
  return {.value = relative ? value / 100 : value, .relative = relative};
}

}  // namespace

std::chrono::nanoseconds to_duration(const std::string& flag, double seconds) {
  if (!(seconds > 0)) {
    std::ostringstream message;
    message << flag << " is " << seconds << ", it must be above 0 seconds";
    throw InvalidOption("OPTION_OUT_OF_RANGE", message.str(), {{"field", flag}});
  }
  constexpr auto kLongest = std::chrono::nanoseconds::max();
  const std::chrono::duration<double> duration(seconds);
  if (duration >= kLongest) return kLongest;
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration);
}

namespace {

/// What both commands have.
void add_common_flags(CLI::App& command, SmoothFlags& flags) {
  add_flag(command, flag::boundary, flags.boundary)
      ->check(CLI::IsMember(names(kBoundaries)))
      ->capture_default_str();
  add_flag(command, flag::feature_angle, flags.feature_angle);
  CLI::Option* relative = add_flag(command, flag::tolerance, flags.tolerance);
  add_flag(command, flag::absolute_tolerance, flags.absolute_tolerance)->excludes(relative);
  add_flag(command, flag::movement_limit, flags.movement_limit);
  add_flag(command, flag::report_below, flags.report_below);
  add_flag(command, flag::compute_budget, flags.compute_budget_seconds);
  add_flag(command, flag::history, flags.history);
}

}  // namespace

void add_smooth_flags(CLI::App& command, SmoothFlags& flags) {
  std::vector<std::string> words;
  for (const auto& [word, method] : method_words()) {
    if (!is_motion(method)) words.push_back(word);
  }
  const auto on_or_off = CLI::IsMember({"on", "off"});
  add_flag(command, flag::method, flags.method)->check(CLI::IsMember(words))->capture_default_str();
  add_method_flags(command, flags, false);
  add_flag(command, flag::form, flags.form)->check(CLI::IsMember(names(kForms)));
  add_flag(command, flag::guard, flags.guard)->check(on_or_off)->capture_default_str();
  add_flag(command, flag::never_worse, flags.never_worse)->check(on_or_off)->capture_default_str();
  add_flag(command, flag::metric, flags.metric)->check(CLI::IsMember(names(kMetrics)));
  add_flag(command, flag::tangled, flags.tangled)
      ->check(CLI::IsMember(words_of(kEnumNames<TangledPolicy>)))
      ->capture_default_str();
  add_flag(command, flag::iterations, flags.iterations);
  CLI::Option* only_below = add_flag(command, flag::only_below, flags.only_below);
  add_flag(command, flag::only_below_rings, flags.only_below_rings)->needs(only_below);
  add_common_flags(command, flags);
}

void add_move_flags(CLI::App& command, SmoothFlags& flags) {
  add_method_flags(command, flags, true);
  add_flag(command, flag::move_iterations, flags.iterations);
  add_common_flags(command, flags);
}

SmoothOptions to_smooth_options(const SmoothFlags& flags) {
  SmoothOptions options;
  options.method = to_method(flags);
  if (flags.form) options.form = kForms.at(*flags.form);
  options.max_iterations = flags.iterations;
  if (flags.tolerance) options.tolerance = {.value = *flags.tolerance, .relative = true};
  if (flags.absolute_tolerance) {
    options.tolerance = {.value = *flags.absolute_tolerance, .relative = false};
  }
  if (flags.movement_limit) options.movement_limit = to_movement_limit(*flags.movement_limit);
  options.history = flags.history;
  options.boundary = kBoundaries.at(flags.boundary);
  if (flags.feature_angle) {
    if (options.boundary != BoundaryPolicy::slide && !sweeps_as_optimize(options.method)) {
      throw InvalidOption("OPTION_MISPLACED",
                          "--feature-angle means nothing without --boundary slide or --method "
                          "optimize",
                          {{"field", "--feature-angle"}});
    }
    options.feature_angle = *flags.feature_angle;
  }
  options.guard = flags.guard == "on";
  options.never_worse = flags.never_worse == "on";
  if (flags.metric) options.metric = kMetrics.at(*flags.metric);
  options.tangled = kTangled.at(flags.tangled);
  if (flags.only_below) options.only_below = {.quality = *flags.only_below};
  if (flags.only_below_rings) options.only_below->rings = *flags.only_below_rings;
  options.report_below = flags.report_below;
  if (flags.compute_budget_seconds) {
    options.compute_budget = to_duration("--compute-budget", *flags.compute_budget_seconds);
  }
  validate(options);
  return options;
}

}  // namespace meshsmooth::cli

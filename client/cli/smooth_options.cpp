#include "smooth_options.hpp"

#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <charconv>
#include <map>
#include <sstream>
#include <system_error>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

const std::map<std::string, Weighting> kWeightings = {
    {"uniform", Weighting::uniform},
    {"inverse-edge-length", Weighting::inverse_edge_length},
    {"edge-length", Weighting::edge_length},
    {"ball-volume", Weighting::ball_volume}};
const std::map<std::string, Goal> kGoals = {
    {"average", Goal::average}, {"balanced", Goal::balanced}, {"worst", Goal::worst}};
const std::map<std::string, Form> kForms = {
    {"jacobi", Form::jacobi}, {"gauss-seidel", Form::gauss_seidel}, {"racing", Form::asynchronous}};

const std::map<std::string, BoundaryPolicy> kBoundaries = {{"fixed", BoundaryPolicy::fixed},
                                                           {"slide", BoundaryPolicy::slide},
                                                           {"free", BoundaryPolicy::free}};

template <class Value>
std::vector<std::string> names(const std::map<std::string, Value>& values) {
  std::vector<std::string> result;
  for (const auto& [name, value] : values) result.push_back(name);
  return result;
}

/// Refuses flags and forms that the chosen method does not have.
void check_belonging(const SmoothFlags& flags) {
  const bool weighted = flags.method == "laplacian" || flags.method == "weighted-laplacian" ||
                        flags.method == "smart-laplacian";
  struct Belonging {
    bool given;
    bool allowed;
    const char* flag;
    const char* methods;
  };
  const bool taubin = flags.method == "taubin";
  const bool hc = flags.method == "hc-laplacian";
  const bool optimize = flags.method == "optimize";
  const bool jacobi = flags.form == "jacobi", racing = flags.form == "racing";
  const Belonging belongings[] = {
      {flags.weighting.has_value(), weighted, "--weighting",
       "laplacian, weighted-laplacian, smart-laplacian"},
      {flags.relaxation.has_value(), weighted, "--relaxation",
       "laplacian, weighted-laplacian, smart-laplacian"},
      {flags.lambda.has_value(), taubin, "--lambda", "taubin"},
      {flags.mu.has_value(), taubin, "--mu", "taubin"},
      {flags.alpha.has_value(), hc, "--alpha", "hc-laplacian"},
      {flags.beta.has_value(), hc, "--beta", "hc-laplacian"},
      {flags.goal.has_value(), optimize, "--goal", "optimize"},
      {flags.target_quality.has_value(), optimize, "--target-quality", "optimize"},
      {jacobi, !optimize, "--form jacobi", "every method but optimize"},
      {racing, !optimize && !hc, "--form racing", "every method but optimize, hc-laplacian"},
      {flags.form == "gauss-seidel", !hc, "--form gauss-seidel", "every method but hc-laplacian"}};
  for (const Belonging& belonging : belongings) {
    if (!belonging.given || belonging.allowed) continue;
    throw InvalidOption("OPTION_MISPLACED",
                        std::string(belonging.flag) + " means nothing to --method " + flags.method +
                            "; it belongs to: " + belonging.methods,
                        {{"field", belonging.flag}});
  }
}

Method to_method(const SmoothFlags& flags) {
  const auto weighted = [&](auto method, const char* default_weighting) {
    method.weighting = kWeightings.at(flags.weighting.value_or(default_weighting));
    method.relaxation = flags.relaxation.value_or(method.relaxation);
    return method;
  };
  if (flags.method == "laplacian") return weighted(Laplacian{}, "uniform");
  if (flags.method == "weighted-laplacian") return weighted(Laplacian{}, "inverse-edge-length");
  if (flags.method == "smart-laplacian") return weighted(SmartLaplacian{}, "uniform");
  if (flags.method == "taubin") {
    Taubin method;
    method.lambda = flags.lambda.value_or(method.lambda);
    method.mu = flags.mu.value_or(method.mu);
    return method;
  }
  if (flags.method == "hc-laplacian") {
    HcLaplacian method;
    method.alpha = flags.alpha.value_or(method.alpha);
    method.beta = flags.beta.value_or(method.beta);
    return method;
  }
  Optimize method;
  if (flags.goal) method.goal = kGoals.at(*flags.goal);
  method.target_quality = flags.target_quality.value_or(method.target_quality);
  return method;
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

void add_smooth_flags(CLI::App& command, SmoothFlags& flags) {
  command
      .add_option("--method", flags.method,
                  "optimize | smart-laplacian | laplacian | weighted-laplacian | taubin | "
                  "hc-laplacian")
      ->check(CLI::IsMember({"laplacian", "weighted-laplacian", "smart-laplacian", "taubin",
                             "hc-laplacian", "optimize"}))
      ->capture_default_str();
  command
      .add_option("--weighting", flags.weighting,
                  "How a node weighs its neighbours (laplacian family)")
      ->check(CLI::IsMember(names(kWeightings)));
  command.add_option("--relaxation", flags.relaxation, "Share of the way to go, (0, 1]");
  command.add_option("--lambda", flags.lambda, "taubin: shrinking step, (0, 1]");
  command.add_option("--mu", flags.mu, "taubin: growing step, below minus lambda");
  command.add_option("--alpha", flags.alpha, "hc-laplacian: weight of the original place, [0, 1]");
  command.add_option("--beta", flags.beta, "hc-laplacian: share of the own push, [0, 1]");
  command
      .add_option("--goal", flags.goal,
                  "optimize: improve the average, the worst elements, or both [balanced]")
      ->check(CLI::IsMember(names(kGoals)));
  command.add_option(
      "--target-quality", flags.target_quality,
      "optimize: done when the worst mean ratio that can change is this good, [0, 1)");
  command.add_option("--form", flags.form, "Order of the moves of a sweep [the method's best]")
      ->check(CLI::IsMember(names(kForms)));
  command
      .add_option("--guard", flags.guard,
                  "off: a valid element may come back inverted (plain averaging)")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command
      .add_option("--tangled", flags.tangled, "What to do with a mesh that has inverted elements")
      ->check(CLI::IsMember({"repair", "refuse"}))
      ->capture_default_str();
  command
      .add_option(
          "--boundary", flags.boundary,
          "slide: boundary nodes move in their plane, on their curved part or along their crease, "
          "corners stay; "
          "free: they move like all others. In both, the file's lower-dimensional elements "
          "move with their nodes")
      ->check(CLI::IsMember(names(kBoundaries)))
      ->capture_default_str();
  command.add_option("--feature-angle", flags.feature_angle,
                     "--boundary slide: planes that meet at less are one curved part; "
                     "degrees, 1 to 90 [30]");
  command.add_option("--iterations", flags.iterations, "Sweeps at most; 0 only judges the mesh")
      ->capture_default_str();
  CLI::Option* relative = command.add_option(
      "--tolerance", flags.tolerance,
      "Done when no node moves by more than this share of the bounding box's diagonal; "
      "optimize: when a sweep lowers the energies by less than this share [1e-4]");
  command
      .add_option("--absolute-tolerance", flags.absolute_tolerance,
                  "Done when no node moves by more than this, in the mesh's unit")
      ->excludes(relative);
  command.add_option("--movement-limit", flags.movement_limit,
                     "How far a node may end from where it began: in the mesh's unit, or with % "
                     "as a share of the bounding box's diagonal");
  command.add_option("--compute-budget", flags.compute_budget_seconds,
                     "Seconds of computing, after which the best result reached is returned");
  command.add_flag("--history", flags.history,
                   "Each sweep's moves, energy and worst mean ratio in the report");
}

SmoothOptions to_smooth_options(const SmoothFlags& flags) {
  check_belonging(flags);
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
    if (options.boundary != BoundaryPolicy::slide) {
      throw InvalidOption("OPTION_MISPLACED",
                          "--feature-angle means nothing without --boundary slide",
                          {{"field", "--feature-angle"}});
    }
    options.feature_angle = *flags.feature_angle;
  }
  options.guard = flags.guard == "on";
  options.tangled = flags.tangled == "refuse" ? TangledPolicy::refuse : TangledPolicy::repair;
  if (flags.compute_budget_seconds) {
    options.compute_budget = to_duration("--compute-budget", *flags.compute_budget_seconds);
  }
  validate(options);
  return options;
}

}  // namespace meshsmooth::cli

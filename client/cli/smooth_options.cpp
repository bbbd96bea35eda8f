#include "smooth_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <map>
#include <ranges>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

/// "smart-laplacian" of "smart_laplacian".
std::string to_word(std::string_view name) {
  std::string word(name);
  std::ranges::replace(word, '_', '-');
  return word;
}

std::vector<std::string> words_of(std::span<const std::string_view> names) {
  std::vector<std::string> words;
  std::ranges::transform(names, std::back_inserter(words), to_word);
  return words;
}

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

/// A name of the command line for a method: its own, or one that presets some fields.
struct MethodWord {
  std::string word;
  Method method;
};

std::vector<MethodWord> method_words() {
  std::vector<MethodWord> words;
  for_each_method([&](const auto& method) {
    words.push_back({to_word(method_name(method)), method});
  });
  for (const MethodPreset& preset : kMethodPresets)
    words.push_back({std::string(preset.name), preset.method});
  // The default first.
  std::ranges::stable_partition(
      words, [](const MethodWord& w) { return w.word == default_method_word(); });
  return words;
}

/// The methods that `belongs` holds of, for an error text.
template <class Belongs>
std::string words_where(const Belongs& belongs) {
  std::string text;
  for (const auto& [word, method] : method_words()) {
    if (belongs(method)) text += (text.empty() ? "" : ", ") + word;
  }
  return text;
}

bool has_flag(const Method& method, std::string_view flag) {
  bool found = false;
  std::visit(
      [&]<class M>(const M&) {
        for_each_field<M>([&](const auto& field) { found = found || field.flag == flag; });
      },
      method);
  return found;
}

bool has_form(const Method& method, Form form) {
  return std::ranges::find(forms_of(method), form) != forms_of(method).end();
}

[[noreturn]] void throw_misplaced(const SmoothFlags& flags, const std::string& flag,
                                  const std::string& methods) {
  throw InvalidOption(
      "OPTION_MISPLACED",
      flag + " is not an option of --method " + flags.method + "; it belongs to: " + methods,
      {{"field", flag}});
}

/// Refuses flags and forms that the chosen method does not have.
void check_belonging(const SmoothFlags& flags, const Method& method) {
  const auto check = [&](const auto& given) {
    for (const auto& [flag, value] : given) {
      if (has_flag(method, flag)) continue;
      throw_misplaced(flags, flag, words_where([&, &name = flag](const Method& m) {
                        return has_flag(m, name);
                      }));
    }
  };
  check(flags.numbers);
  check(flags.choices);
  if (!flags.form || has_form(method, kForms.at(*flags.form))) return;
  throw_misplaced(flags, "--form " + *flags.form, words_where([&](const Method& m) {
                    return has_form(m, kForms.at(*flags.form));
                  }));
}

Method to_method(const SmoothFlags& flags) {
  const std::vector<MethodWord> words = method_words();
  Method method = std::ranges::find(words, flags.method, &MethodWord::word)->method;
  check_belonging(flags, method);
  std::visit(
      [&]<class M>(M& m) {
        for_each_field<M>([&]<class Field>(const Field& field) {
          const std::string flag(field.flag);
          if constexpr (std::is_same_v<Field, NumberField<M>>) {
            if (const auto given = flags.numbers.find(flag); given != flags.numbers.end()) {
              m.*field.member = given->second;
            }
          } else if (const auto given = flags.choices.find(flag); given != flags.choices.end()) {
            const auto place = std::ranges::find(field.choices, given->second, to_word);
            using Enum = std::remove_reference_t<decltype(m.*field.member)>;
            m.*field.member = static_cast<Enum>(place - field.choices.begin());
          }
        });
      },
      method);
  return method;
}

/// "0.6307", as short as it can be read back.
std::string number_text(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

/// Whether the command `move` has a method, else the command `smooth`.
template <class M>
constexpr bool kMoves = std::is_same_v<M, Move>;

/// One flag for each field of a command's methods; what several methods share, once.
void add_method_flags(CLI::App& command, SmoothFlags& flags, bool moves) {
  for_each_method([&]<class M>(const M& method) {
    if (kMoves<M> != moves) return;
    for_each_field<M>([&]<class Field>(const Field& field) {
      const std::string flag(field.flag);
      if (command.get_option_no_throw(flag) != nullptr) return;
      const std::string owners = words_where([&](const Method& m) {
        return std::holds_alternative<Move>(m) == moves && has_flag(m, flag);
      });
      const std::string help =
          moves ? std::string(field.help) : owners + ": " + std::string(field.help);
      if constexpr (std::is_same_v<Field, NumberField<M>>) {
        command.add_option_function<double>(
            flag, [&flags, flag](const double& value) { flags.numbers[flag] = value; },
            help + " [" + number_text(method.*field.member) + "]");
      } else {
        const auto chosen = static_cast<std::size_t>(method.*field.member);
        command
            .add_option_function<std::string>(
                flag, [&flags, flag](const std::string& value) { flags.choices[flag] = value; },
                help + " [" + to_word(field.choices[chosen]) + "]")
            ->check(CLI::IsMember(words_of(field.choices)));
      }
    });
  });
}

/// "taubin 20, hc-laplacian 10, others 1000".
std::string iterations_text() {
  std::string text;
  for_each_method([&](const auto& method) {
    if (default_iterations(method) == kAmpleIterations || kMoves<std::decay_t<decltype(method)>>)
      return;
    text += to_word(method_name(method)) + " " + std::to_string(default_iterations(method)) + ", ";
  });
  return text + "others " + std::to_string(kAmpleIterations);
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

std::string default_method_word() { return to_word(method_name(SmoothOptions{}.method)); }

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
  command
      .add_option(
          "--boundary", flags.boundary,
          "Boundary nodes. slide: they move in their plane, on their curved part or along their "
          "crease, corners stay; free: they move like all others. In both, the file's "
          "lower-dimensional cells move with their nodes")
      ->check(CLI::IsMember(names(kBoundaries)))
      ->capture_default_str();
  command.add_option("--feature-angle", flags.feature_angle,
                     "Largest angle between planes of one curved part, with --boundary slide, or "
                     "between facets without a feature edge, of optimize on a surface mesh; in "
                     "degrees, 1 to 90 [30]");
  CLI::Option* relative = command.add_option(
      "--tolerance", flags.tolerance,
      "Largest move that ends the run, as a share of the bounding box's diagonal; "
      "optimize: smallest decrease of the energies in a sweep, as a share [1e-4]");
  command
      .add_option("--absolute-tolerance", flags.absolute_tolerance,
                  "Largest move that ends the run, in the mesh's unit")
      ->excludes(relative);
  command.add_option(
      "--movement-limit", flags.movement_limit,
      "Largest distance of a node from its original position, in the mesh's unit or, "
      "with %, as a share of the bounding box's diagonal [none]");
  command.add_option("--report-below", flags.report_below,
                     "Mean ratio against the target: elements of the result below it are counted "
                     "by what holds them there (optimize only), (0, 1] [none]");
  command.add_option("--compute-budget", flags.compute_budget_seconds,
                     "Computing time after which the best result so far is returned, in seconds "
                     "[none]");
  command.add_flag("--history", flags.history,
                   "Moves, energy and worst mean ratio of each sweep in the report");
}

}  // namespace

void add_smooth_flags(CLI::App& command, SmoothFlags& flags) {
  std::vector<std::string> words;
  for (const auto& [word, method] : method_words()) {
    if (!std::holds_alternative<Move>(method)) words.push_back(word);
  }
  command.add_option("--method", flags.method, "Smoothing method")
      ->check(CLI::IsMember(words))
      ->capture_default_str();
  add_method_flags(command, flags, false);
  command.add_option("--form", flags.form, "Order of the moves in a sweep [the method's first]")
      ->check(CLI::IsMember(names(kForms)));
  command
      .add_option("--guard", flags.guard,
                  "Guard of valid elements; off: they may come back inverted")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command
      .add_option("--never-worse", flags.never_worse,
                  "Nodes go back where the worst element or the mean quality would be worse than "
                  "before; off: they do not, as without the guard")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command
      .add_option("--metric", flags.metric,
                  "Metric of --never-worse; scaled-jacobian: optimize raises its least value too "
                  "[the worst element by both; the mean of mean-ratio for triangles and "
                  "tetrahedra, of scaled-jacobian else]")
      ->check(CLI::IsMember(names(kMetrics)));
  command.add_option("--tangled", flags.tangled, "Treatment of a mesh with inverted elements")
      ->check(CLI::IsMember(words_of(kEnumNames<TangledPolicy>)))
      ->capture_default_str();
  command.add_option("--iterations", flags.iterations,
                     "Iteration limit; 0 only evaluates the mesh [" + iterations_text() + "]");
  CLI::Option* only_below = command.add_option(
      "--only-below", flags.only_below,
      "Mean ratio, for optimize against the target: only elements below it are improved, (0, 1] "
      "[all are]");
  command
      .add_option("--only-below-rings", flags.only_below_rings,
                  "Rings of nodes around the elements of --only-below that move too [2]")
      ->needs(only_below);
  add_common_flags(command, flags);
}

void add_move_flags(CLI::App& command, SmoothFlags& flags) {
  add_method_flags(command, flags, true);
  command.add_option(
      "--iterations", flags.iterations,
      "Limit of the sweeps of all steps; 0: the displacement alone is continued into "
      "the mesh [" +
          std::to_string(default_iterations(Move{})) + "]");
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

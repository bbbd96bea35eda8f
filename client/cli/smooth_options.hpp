#pragma once

#include <CLI/App.hpp>
#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "meshsmooth/options.hpp"

namespace meshsmooth::cli {

/// `SmoothOptions{}.method` as the command line writes it.
[[nodiscard]] std::string default_method_word();

/// The flags of `smooth` and `move` that say how, as text and numbers.
struct SmoothFlags {
  std::string method = default_method_word();
  std::map<std::string, double> numbers;       // of the method's fields, by flag
  std::map<std::string, std::string> choices;  // of them too
  std::optional<std::string> form;
  std::string tangled = "repair";
  std::string guard = "on";
  std::string never_worse = "on";
  std::optional<std::string> metric;
  std::string boundary = "fixed";
  std::optional<double> feature_angle;
  std::optional<int> iterations;
  std::optional<double> tolerance;
  std::optional<double> absolute_tolerance;
  std::optional<std::string> movement_limit;  // "0.5", "2%"
  std::optional<double> compute_budget_seconds;
  std::optional<double> only_below;
  std::optional<int> only_below_rings;
  std::optional<double> report_below;
  bool history = false;
};

/// Adds the flags to a command; `flags` must outlive it.
void add_smooth_flags(CLI::App& command, SmoothFlags& flags);
/// Those of the method `Move`.
void add_move_flags(CLI::App& command, SmoothFlags& flags);

/// The seconds given by a flag. Throws `InvalidOption` (OPTION_OUT_OF_RANGE) unless they
/// are above 0; more than 292 years are cut.
[[nodiscard]] std::chrono::nanoseconds to_duration(const std::string& flag, double seconds);

/// Throws `InvalidOption` (OPTION_MISPLACED, OPTION_OUT_OF_RANGE) or
/// `NotSupported` (OPTION_NOT_SUPPORTED).
[[nodiscard]] SmoothOptions to_smooth_options(const SmoothFlags& flags);

}  // namespace meshsmooth::cli

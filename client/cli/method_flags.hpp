#pragma once

#include <CLI/App.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "meshsmooth/options.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::cli {

/// "smart-laplacian" of "smart_laplacian".
[[nodiscard]] std::string to_word(std::string_view name);
[[nodiscard]] std::vector<std::string> words_of(std::span<const std::string_view> names);

/// A name of the command line for a method: its own, or one that presets some fields.
struct MethodWord {
  std::string word;
  Method method;
};

/// All of them, the default first.
[[nodiscard]] std::vector<MethodWord> method_words();

/// One flag for each field of the methods of the command `move` or `smooth`; what several methods
/// share, once.
void add_method_flags(CLI::App& command, SmoothFlags& flags, bool moves);

/// The method with the values of the flags. Throws `InvalidOption` (OPTION_MISPLACED) for flags and
/// forms that it does not have.
[[nodiscard]] Method to_method(const SmoothFlags& flags);

}  // namespace meshsmooth::cli

#pragma once

#include <limits>
#include <span>
#include <string_view>

#include "meshsmooth/methods.hpp"

/// How the fields of a method are described; method_table.hpp describes those of each.
namespace meshsmooth {

/// An interval of numbers; an infinite end is no bound, and infinity itself is never inside.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_included = true;
  bool upper_included = true;

  /// False for a NaN.
  [[nodiscard]] constexpr bool contains(double value) const {
    const bool above = lower_included ? value >= lower : value > lower;
    const bool below = upper_included ? value <= upper : value < upper;
    return above && below && value < std::numeric_limits<double>::infinity() &&
           value > -std::numeric_limits<double>::infinity();
  }
};

/// A number of a method.
template <class M>
struct NumberField {
  using Member = double M::*;  // nvcc's host code of the plain form draws a warning

  std::string_view name;  // in meshsmooth.v1
  Member member;
  Range range;
  std::string_view range_text;  // "above 0 and at most 1"
  std::string_view flag;        // of the command line
  std::string_view help;        // noun phrase with unit or range
  /// What the other fields demand besides.
  bool (*agrees)(const M&) = nullptr;
  /// Whether the wire has it in SmoothingOptions itself, not in the method's message.
  bool in_options = false;

  [[nodiscard]] bool is_valid(const M& method) const {
    return range.contains(method.*member) && (agrees == nullptr || agrees(method));
  }
};

/// A choice of a method.
template <class M, class Enum>
struct ChoiceField {
  using Member = Enum M::*;

  std::string_view name;  // in meshsmooth.v1
  Member member;
  std::span<const std::string_view> choices;  // the names of the enumerators
  std::string_view flag;                      // empty: the function that is called decides
  std::string_view help;
};

/// Iterations that most methods may take: they converge long before.
inline constexpr int kAmpleIterations = 1000;

/// The longest series of `WindowedSinc`. Its design costs up to 500 times as many sines.
inline constexpr int kMostFilterIterations = 10000;

/// Specialised for each method:
/// - `name`: in meshsmooth.v1, lower_snake_case;
/// - `default_iterations`: the limit when the caller sets none;
/// - `forms`: those that it has, the first when the caller chooses none;
/// - `form_reason`: why it has only these, for the error; empty when it has all;
/// - `fields`: a tuple of `NumberField` and `ChoiceField`.
template <class M>
struct MethodTraits;

}  // namespace meshsmooth

#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off

#include <array>
#include <string_view>
#include <tuple>

#include "meshsmooth/method_field.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth {

/// The range of a number among the options.
struct OptionRange {
  Range range;
  std::string_view text;  // "from 1 to 90 degrees"
};

/// A member of `SmoothOptions` that the wire has as it is.
template <class Value>
struct OptionField {
  std::string_view name;  // in meshsmooth.v1.SmoothingOptions
  Value SmoothOptions::*member;
  std::string_view noun;  // of its values
};

namespace option {

inline constexpr OptionRange iterations = {{.lower = 0}, "0 or more"};
inline constexpr OptionRange tolerance = {{.lower = 0}, "finite and 0 or more"};
inline constexpr OptionRange absolute_tolerance = {{.lower = 0}, "finite and 0 or more"};
inline constexpr OptionRange compute_budget = {{.lower = 0, .lower_included = false}, "above 0 seconds"};
inline constexpr OptionRange feature_angle = {{.lower = 1, .upper = 90}, "from 1 to 90 degrees"};
inline constexpr OptionRange movement_limit = {{.lower = 0, .lower_included = false}, "finite and above 0"};
inline constexpr OptionRange only_below = {{.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1"};
inline constexpr OptionRange only_below_rings = {{.lower = 0}, "0 or more"};
inline constexpr OptionRange report_below = {{.lower = 0, .upper = 1, .lower_included = false}, "above 0 and at most 1"};

}  // namespace option

/// Those members.
inline constexpr auto kOptionFields = std::make_tuple(
    OptionField<std::optional<std::chrono::nanoseconds>>{"compute_budget", &SmoothOptions::compute_budget, "seconds"},
    OptionField<BoundaryPolicy>{"boundary_policy", &SmoothOptions::boundary, "policy"},
    OptionField<bool>{"guard", &SmoothOptions::guard, "bool"},
    OptionField<bool>{"never_worse", &SmoothOptions::never_worse, "bool"},
    OptionField<std::optional<QualityMetric>>{"metric", &SmoothOptions::metric, "metric"},
    OptionField<TangledPolicy>{"tangled_policy", &SmoothOptions::tangled, "policy"},
    OptionField<std::optional<double>>{"report_below", &SmoothOptions::report_below, "number"},
    OptionField<Form>{"form", &SmoothOptions::form, "form"});

}  // namespace meshsmooth

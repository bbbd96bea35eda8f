#include "meshsmooth/options.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

/// By `Form`.
constexpr std::string_view kFormNames[] = {"automatic", "jacobi", "gauss_seidel", "asynchronous"};

// Written so that a NaN fails.
void need(bool in_range, const std::string& field, double value, std::string_view range) {
  if (in_range) return;
  std::ostringstream message;
  message << field << " is " << value << ", it must be " << range;
  throw InvalidOption("OPTION_OUT_OF_RANGE", message.str(), {{"field", field}});
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
                         ", it has only the " +
                         std::string(kFormNames[int(Traits::forms.front())]) + " form",
                     {{"field", "form"}});
}

}  // namespace

void validate(const SmoothOptions& options) {
  std::visit([](const auto& method) { validate_method(method); }, options.method);
  const int limit = iteration_limit(options);
  need(limit >= 0, "max_iteration_count", limit, "0 or more");
  if (std::holds_alternative<WindowedSinc>(options.method)) {
    need(limit <= kMostFilterIterations, "max_iteration_count", limit,
         "at most " + std::to_string(kMostFilterIterations) + " for windowed_sinc");
  }
  const double tolerance = options.tolerance.value;
  need(tolerance >= 0 && std::isfinite(tolerance),
       options.tolerance.relative ? "convergence_tolerance" : "absolute_tolerance", tolerance,
       "finite and 0 or more");
  need(options.feature_angle >= 1 && options.feature_angle <= 90, "feature_angle",
       options.feature_angle, "from 1 to 90 degrees");
  if (options.compute_budget) {
    const double seconds = std::chrono::duration<double>(*options.compute_budget).count();
    need(seconds > 0, "compute_budget", seconds, "above 0 seconds");
  }
  if (options.movement_limit) {
    const double length = options.movement_limit->value;
    need(length > 0 && std::isfinite(length),
         options.movement_limit->relative ? "movement_limit" : "absolute_movement_limit", length,
         "finite and above 0");
  }
  std::visit([&](const auto& method) { validate_form(method, options.form); }, options.method);
}

}  // namespace meshsmooth

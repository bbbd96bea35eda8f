#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>

#include "meshsmooth/method_table.hpp"

/// What a user can name of a method: `validate`, the wire's codec, the command line and
/// GetServerInfo read it from here. `proto/declaration/methods.toml` declares it.
namespace meshsmooth {

/// Calls `visit(M{})` for each method M, in the order of `Method`.
template <class Visit>
constexpr void for_each_method(Visit&& visit) {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (visit(std::variant_alternative_t<I, Method>{}), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Method>>{});
}

/// Calls `visit(field)` for each field of method M.
template <class M, class Visit>
constexpr void for_each_field(Visit&& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, MethodTraits<M>::fields);
}

/// "laplacian", "smart_laplacian", "taubin", "hc_laplacian", "optimize", "windowed_sinc",
/// "move".
[[nodiscard]] inline std::string_view method_name(const Method& method) {
  return std::visit([]<class M>(const M&) { return MethodTraits<M>::name; }, method);
}

/// The iteration limit that holds when the caller sets none.
[[nodiscard]] inline int default_iterations(const Method& method) {
  return std::visit([]<class M>(const M&) { return MethodTraits<M>::default_iterations; }, method);
}

/// The forms that a method has, the default first.
[[nodiscard]] inline std::span<const Form> forms_of(const Method& method) {
  return std::visit(
      []<class M>(const M&) -> std::span<const Form> { return MethodTraits<M>::forms; }, method);
}

}  // namespace meshsmooth

#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "meshsmooth/enums.hpp"

namespace meshsmooth {

/// The name of a backend: "auto", "cpu", "cuda" (any device) or "cuda:N".
struct BackendName {
  BackendKind kind = BackendKind::automatic;
  std::optional<int> device = {};  // 0 or more; only kinds that compute on devices have one

  bool operator==(const BackendName&) const = default;
};

/// Whether backends of a kind compute on numbered devices, in memory of their own.
[[nodiscard]] constexpr bool has_devices(BackendKind kind) { return kind == BackendKind::cuda; }

/// What a backend may be called, for messages: "auto, cpu, cuda", with devices "auto, cpu, cuda,
/// cuda:N".
[[nodiscard]] inline std::string backend_name_list(bool with_devices) {
  std::string text;
  for (const BackendKind kind : enum_values<BackendKind>()) {
    const std::string name(enum_name(kind));
    text += (text.empty() ? "" : ", ") + name;
    if (with_devices && has_devices(kind)) text += ", " + name + ":N";
  }
  return text;
}

/// Nothing when the text is no name of a backend.
[[nodiscard]] inline std::optional<BackendName> parse_backend_name(std::string_view text) {
  const std::size_t colon = text.find(':');
  constexpr auto kKinds = enum_values<BackendKind>();
  const auto* const found =
      std::ranges::find(kKinds, text.substr(0, colon), enum_name<BackendKind>);
  if (found == kKinds.end()) return std::nullopt;
  BackendName name{*found};
  if (colon == std::string_view::npos) return name;
  const char* const end = text.data() + text.size();
  int device = -1;
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, device);
  if (error != std::errc() || rest != end || device < 0 || !has_devices(name.kind)) {
    return std::nullopt;
  }
  name.device = device;
  return name;
}

/// "auto", "cpu", "cuda", "cuda:1".
[[nodiscard]] inline std::string to_string(const BackendName& name) {
  std::string text(enum_name(name.kind));
  if (name.device) text += ":" + std::to_string(*name.device);
  return text;
}

}  // namespace meshsmooth

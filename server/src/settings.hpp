#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "meshsmooth/server_config.hpp"

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// Durations are in seconds.
using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

/// One setting of the table: its key, what it means, and the member of the configuration.
struct Setting {
  std::string key;
  std::string text;  // with the unit of a number, and what 0 or an empty value means
  /// Adds the flag --KEY, which writes to `config`; a value out of range ends in
  /// CLI::ValidationError.
  std::function<void(CLI::App& app, ServerConfig& config, const std::string& text)> add_flag;
  std::function<SettingValue(const ServerConfig& config)> value;
};

/// The table of all settings, in the order of the help. Flags, environment, files, the log's first
/// line and the table in docs/operations.md follow from it.
[[nodiscard]] const std::vector<Setting>& settings();

}  // namespace meshsmooth::server

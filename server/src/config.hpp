#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "meshsmooth/server_config.hpp"

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// Binds every setting to its flag. `config` must outlive `app`. Values out of
/// range end in CLI::ValidationError.
void add_options(CLI::App& app, ServerConfig& config);

/// The settings of a program whose `app` has no other arguments than switches of
/// its own. A flag (--max-job-bytes) counts before the environment
/// (MESHSMOOTH_MAX_JOB_BYTES; empty means unset), that before the file named by
/// --config or MESHSMOOTH_CONFIG (max-job-bytes), and that before the default.
/// Throws InvalidOption (OPTION_OUT_OF_RANGE) naming field, value and source of a
/// wrong value; of CLI11's exceptions those for --help and for arguments that do
/// not exist.
[[nodiscard]] ServerConfig read_config(CLI::App& app, int argc, const char* const* argv);

/// One setting as somebody gave it, not yet checked.
struct GivenSetting {
  std::string key;
  std::string value;
  std::string source;
};

/// The lines `key = value` of a configuration file, a subset of TOML: numbers,
/// true, false, "strings" with \" and \\, 'strings' as they are, # comments.
/// Throws InvalidOption naming file and line of anything else.
[[nodiscard]] std::vector<GivenSetting> parse_config_file(std::istream& file,
                                                          const std::string& name);

using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

/// Every setting by its key, in the order of the help.
[[nodiscard]] std::vector<std::pair<std::string, SettingValue>> list_settings(
    const ServerConfig& config);

/// A configuration file that says the same.
[[nodiscard]] std::string describe(const ServerConfig& config);

}  // namespace meshsmooth::server

#pragma once

#include <istream>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/server_config.hpp"
#include "settings.hpp"

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// Binds every setting to its flag. `config` must outlive `app`. Values out of
/// range end in CLI::ValidationError.
void add_options(CLI::App& app, ServerConfig& config);

/// Binds the file of settings to its flag. `path` must outlive `app`.
void add_config_option(CLI::App& app, std::string& path);

/// The settings of a program whose `app` has no arguments besides switches of its own. A flag
/// (--max-job-bytes) takes precedence over the environment (MESHSMOOTH_MAX_JOB_BYTES; empty means
/// unset), that over the file named by --config or MESHSMOOTH_CONFIG (max-job-bytes), and that
/// over the default. Throws InvalidOption (OPTION_OUT_OF_RANGE) naming field, value and source of
/// a wrong value; of CLI11's exceptions those for --help and for unknown arguments.
[[nodiscard]] ServerConfig read_config(CLI::App& app, int argc, const char* const* argv);

/// The environment variables MESHSMOOTH_… that are set and no setting of the server, sorted:
/// perhaps a mistyped one. Without those of our clients and of Kubernetes, which sets some for
/// Services named meshsmooth (MESHSMOOTH_PORT). Not an error, for others may have their own.
[[nodiscard]] std::vector<std::string> unknown_environment();

/// A setting as the user gave it, not yet checked.
struct GivenSetting {
  std::string key;
  std::string value;
  std::string source;
};

/// The lines `key = value` of a configuration file, a subset of TOML: numbers,
/// true, false, "strings" with \" and \\, 'strings' without escapes, # comments.
/// Throws InvalidOption naming file and line of anything else.
[[nodiscard]] std::vector<GivenSetting> parse_config_file(std::istream& file,
                                                          const std::string& name);

/// The value of every setting by its key, in the order of the help.
[[nodiscard]] std::vector<std::pair<std::string, SettingValue>> list_settings(
    const ServerConfig& config);

/// The configuration file with these settings.
[[nodiscard]] std::string describe(const ServerConfig& config);

/// Throws InvalidOption (OPTION_OUT_OF_RANGE).
[[noreturn]] void throw_wrong_setting(const std::string& field, const std::string& what);

}  // namespace meshsmooth::server

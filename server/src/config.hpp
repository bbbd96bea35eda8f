#pragma once

#include <string>

#include "meshsmooth/server_config.hpp"

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// Binds every setting to its flag, its environment variable (--max-job-bytes
/// is MESHSMOOTH_MAX_JOB_BYTES) and its key in a configuration file. `config`
/// must outlive `app`. Out of range values end in CLI::ValidationError.
void add_options(CLI::App& app, ServerConfig& config);

/// Every setting as key=value, each followed by `separator`; with '\n' a valid
/// configuration file.
[[nodiscard]] std::string describe(const ServerConfig& config, char separator);

}  // namespace meshsmooth::server

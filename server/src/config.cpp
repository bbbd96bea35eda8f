#include "config.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>
#include <string_view>
#include <type_traits>

#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

/// A size in bytes, of at least 0: 8GiB is understood.
struct Bytes {};

CLI::Validator text_that(const std::string& what, bool (*fits)(std::string_view)) {
  return {[=](std::string& text) { return fits(text) ? std::string() : "it is not " + what; }, ""};
}

/// CLI11's own lets "nan" through, which is in no range.
CLI::Validator seconds_range() {
  const CLI::Range range(0.0, 1e6);
  return {[range](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::isnan(value)) {
              return text + " is no number";
            }
            return range(text);
          },
          range.get_description()};
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

bool is_number(std::string_view text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_address(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  return colon != std::string_view::npos && colon > 0 && is_number(text.substr(colon + 1)) &&
         is_printable(text) && text.find_first_of(", ") == std::string_view::npos;
}

bool is_listen_address(std::string_view text) {
  if (text.starts_with("unix:")) return text.size() > 5 && is_printable(text);
  return text.empty() || is_address(text);
}

bool is_admin_address(std::string_view text) { return text.empty() || is_address(text); }

bool is_backend(std::string_view text) { return parse_backend_name(text).has_value(); }

bool is_device_list(std::string_view text) {
  if (text == "all") return true;
  std::set<int> seen;
  while (!text.empty()) {
    const std::string_view number = text.substr(0, text.find(','));
    int device = 0;
    const auto [end, error] = std::from_chars(number.begin(), number.end(), device);
    if (error != std::errc() || end != number.end() || !seen.insert(device).second) return false;
    if (number.size() + 1 == text.size()) return false;  // it ends in a comma
    text.remove_prefix(std::min(number.size() + 1, text.size()));
  }
  return !seen.contains(-1) && (seen.empty() || *seen.begin() >= 0);
}

/// Calls `visit(key, member, text, check)` for every setting: a CLI::Validator
/// says what is in range, or `Bytes`.
template <class Config, class Visit>
void visit_settings(Config& config, const Visit& visit) {
  const Bytes bytes;
  const CLI::Validator none;
  const auto text = text_that("printable", is_printable);
  const auto seconds = seconds_range();
  const auto message_bytes = CLI::Range(4096, 1 << 30);
  // Clients send chunks of 1 MiB, whatever is set.
  const auto received_message_bytes = CLI::Range(2 << 20, 1 << 30);
  const auto counts = CLI::Range(std::int64_t{1}, std::int64_t{INT32_MAX});

  visit("listen", config.listen, "HOST:PORT or unix:PATH to serve on; port 0 picks one",
        text_that("HOST:PORT or unix:PATH", is_listen_address));
  visit("admin-listen", config.admin_listen,
        "HOST:PORT of /metrics, /healthz and /readyz in plain HTTP; empty: none",
        text_that("HOST:PORT", is_admin_address));
  visit("insecure", config.insecure,
        "Serve in clear even on an address that others reach; something else protects it", none);
  visit("tls-cert", config.tls_cert, "PEM file: the server's certificate, with its chain", text);
  visit("tls-key", config.tls_key, "PEM file: its key", text);
  visit("tls-client-ca", config.tls_client_ca,
        "PEM file: clients must show a certificate that one of these has signed", text);
  visit("token-file", config.token_file,
        "File of lines IDENTITY:TOKEN or IDENTITY:sha256:HEX; calls must carry such a token", text);
  visit("credentials-reload-interval-seconds", config.credentials_reload_interval_seconds,
        "How often those files are looked at", seconds);
  visit("max-metadata-bytes", config.max_metadata_bytes, "Of one call", CLI::Range(1024, 1 << 20));
  visit("max-jobs-per-identity", config.max_jobs_per_identity,
        "Living jobs of one caller; 0: no limit", CLI::Range(0, 1'000'000));
  visit("max-bytes-per-identity", config.max_bytes_per_identity,
        "Memory promised to those; 0: no limit", bytes);

  visit("backend", config.backend, "auto, cpu, cuda or cuda:N",
        text_that("auto, cpu, cuda or cuda:N", is_backend));
  visit("devices", config.devices,
        "GPUs: all, or by number, as in 0,2; empty: the one of --backend",
        text_that("all, or numbers of GPUs as in 0,2, each once", is_device_list));
  visit("lanes", config.lanes,
        "Jobs that run at the same time on each device; 0: 4 on CUDA, 2 to 8 on the CPU",
        CLI::Range(0, 1024));
  visit("threads-per-lane", config.threads_per_lane,
        "Of a job at most; 0: all cores, which jobs at the same time share", CLI::Range(0, 4096));

  visit("host-memory-limit-bytes", config.host_memory_limit_bytes,
        "Memory for all jobs, 8GiB is understood; 0: 80 % of what machine and cgroup allow", bytes);
  visit("device-bytes", config.device_bytes,
        "Memory of each device for all jobs, at most; 0: what is free at the start, less a margin",
        bytes);
  visit("idle-pinned-bytes", config.idle_pinned_bytes,
        "Memory of meshes kept for the next jobs, page-locked where a device computes; 0: 1/16 of "
        "the host memory limit, at most 1 GiB",
        bytes);
  visit("max-job-bytes", config.max_job_bytes, "Memory for one job; 0: the host memory limit",
        bytes);
  visit("max-node-count", config.max_node_count, "Nodes of one mesh", counts);
  visit("max-element-count", config.max_element_count, "Elements of one mesh", counts);
  visit("max-queued-jobs", config.max_queued_jobs, "Jobs admitted but not yet running",
        CLI::Range(1, 1'000'000));
  visit("max-queued-bytes", config.max_queued_bytes,
        "Mesh bytes of those jobs; 0: the host memory limit", bytes);
  visit("max-kept-jobs", config.max_kept_jobs, "Ended jobs that ListJobs still knows",
        CLI::Range(0, 1'000'000));

  visit("max-result-ttl-seconds", config.max_result_ttl_seconds,
        "Longest that a result is kept for a caller who asks for it", seconds);
  visit("max-kept-result-bytes", config.max_kept_result_bytes,
        "Positions kept so, the oldest go first; 0: a quarter of the host memory limit", bytes);

  visit("max-topology-bytes", config.max_topology_bytes,
        "Topologies kept for jobs that name them; 0: a quarter of the host memory limit", bytes);

  visit("priority-ageing-seconds", config.priority_ageing_seconds,
        "A job that waited so long counts as one priority higher; 0: never", seconds);
  visit("max-queue-timeout-seconds", config.max_queue_timeout_seconds, "Longest wait in the queue",
        seconds);
  visit("stream-idle-timeout-seconds", config.stream_idle_timeout_seconds,
        "Longest pause within an upload", seconds);
  visit("drop-timeout-seconds", config.drop_timeout_seconds,
        "How long a refused client may take to stop sending", seconds);
  visit("lame-duck-seconds", config.lame_duck_seconds,
        "On SIGTERM: not serving by health, but still accepting", seconds);
  visit("drain-grace-seconds", config.drain_grace_seconds,
        "After that: for the running jobs to finish", seconds);

  visit("lane-watchdog-seconds", config.lane_watchdog_seconds,
        "A lane that holds a stopped job so long breaks the server", seconds);
  visit("warm-up", config.warm_up, "Run tiny jobs on each lane before serving; =false: not", none);

  visit("early-data-bytes", config.early_data_bytes,
        "What clients may send before they are accepted", CLI::Range(0, 1 << 22));
  visit("max-chunk-bytes", config.max_chunk_bytes, "Largest chunk clients should send",
        message_bytes);
  visit("result-chunk-bytes", config.result_chunk_bytes, "Size of the chunks sent", message_bytes);
  visit("max-receive-message-bytes", config.max_receive_message_bytes,
        "Larger messages end the call", received_message_bytes);
  visit("stream-window-bytes", config.stream_window_bytes,
        "Flow-control window of a stream; 0: adapts to the network", CLI::Range(0, 1 << 30));
  visit("max-concurrent-streams", config.max_concurrent_streams, "Calls per connection",
        CLI::Range(1, 1'000'000));
  visit("keepalive-time-seconds", config.keepalive_time_seconds, "Ping a silent connection after",
        seconds);
  visit("keepalive-timeout-seconds", config.keepalive_timeout_seconds,
        "Close it when the ping is not answered within", seconds);
  visit("min-client-ping-interval-seconds", config.min_client_ping_interval_seconds,
        "Clients that ping more often are sent away", seconds);
  visit("max-connection-age-seconds", config.max_connection_age_seconds,
        "Connections take no new calls after; 0: never", seconds);

  visit("log-level", config.log_level, "debug, info, warn, error or off",
        CLI::IsMember({"debug", "info", "warn", "error", "off"}));
  visit("log-format", config.log_format, "text or json", CLI::IsMember({"text", "json"}));
}

CLI::Option* add_check(CLI::Option* option, const CLI::Validator& validator) {
  return option->check(validator);
}

CLI::Option* add_check(CLI::Option* option, Bytes) {
  // Unlike CLI11's own it leaves what it cannot read as it was.
  const auto read_size = [](std::string& text) {
    std::string number = text;
    std::string problem = CLI::AsSizeValue(false)(number);
    if (problem.empty()) text = number;
    return problem;
  };
  return option->transform(CLI::Validator(read_size, "SIZE"))
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
}

std::string environment_name(std::string_view key) {
  std::string name = "MESHSMOOTH_";
  for (const unsigned char c : key) {
    name += c == '-' ? '_' : static_cast<char>(std::toupper(c));
  }
  return name;
}

std::string environment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  return value == nullptr ? std::string() : value;
}

[[noreturn]] void throw_wrong(const std::string& field, const std::string& what) {
  throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": " + what, {{"field", field}});
}

void apply(ServerConfig& config, const GivenSetting& given) {
  CLI::App app;
  app.set_help_flag();  // which is no setting
  add_options(app, config);
  const std::string flag = "--" + given.key;
  if (app.get_option_no_throw(flag) == nullptr) {
    throw_wrong(given.key, "there is no such setting (" + given.source + ")");
  }
  try {
    // CLI11 takes the arguments in reverse; an empty value must stand alone.
    app.parse(given.value.empty() ? std::vector<std::string>{given.value, flag}
                                  : std::vector<std::string>{flag + "=" + given.value});
  } catch (const CLI::ParseError& error) {
    std::string why = error.what();
    if (why.starts_with(flag + ": ")) why.erase(0, flag.size() + 2);
    throw_wrong(given.key,
                fmt::format("\"{}\" ({}) cannot be: {}", given.value, given.source, why));
  }
}

std::vector<GivenSetting> given_by_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw_wrong("config", "cannot read the file " + path);
  return parse_config_file(file, path);
}

std::vector<GivenSetting> given_by_environment() {
  std::vector<GivenSetting> given;
  for (const auto& [key, value] : list_settings({})) {
    const std::string name = environment_name(key);
    std::string text = environment(name);
    if (!text.empty()) given.push_back({key, std::move(text), "environment, " + name});
  }
  return given;
}

std::string trim(std::string_view text) {
  const auto is_space = [](unsigned char c) { return std::isspace(c) != 0; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

/// Takes the value and leaves what stands behind it; false when it is none.
bool take_value(std::string_view& text, std::string& value) {
  value.clear();
  const char quote = text.empty() ? '\0' : text.front();
  if (quote != '"' && quote != '\'') {
    const std::size_t end = std::min(text.find_first_of(" \t#"), text.size());
    value = text.substr(0, end);
    text.remove_prefix(end);
    return !value.empty() && value.find_first_of("\"'[]{},=") == std::string::npos;
  }
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == quote) {
      text.remove_prefix(i + 1);
      return true;
    }
    if (quote == '"' && text[i] == '\\') {
      ++i;
      if (i == text.size() || (text[i] != '"' && text[i] != '\\')) return false;
    }
    value += text[i];
  }
  return false;
}

std::string toml(const SettingValue& value) {
  return std::visit(
      []<class T>(const T& v) {
        if constexpr (!std::is_same_v<T, std::string>) {
          return fmt::format("{}", v);
        } else {
          std::string quoted = "\"";
          for (const char c : v) {
            if (c == '"' || c == '\\') quoted += '\\';
            quoted += c;
          }
          return quoted + '"';
        }
      },
      value);
}

}  // namespace

void add_options(CLI::App& app, ServerConfig& config) {
  visit_settings(config, [&app](const std::string& key, auto& value, const std::string& text,
                                const auto& check) {
    const std::string with_environment = text + " (" + environment_name(key) + ")";
    if constexpr (std::is_same_v<decltype(value), bool&>) {
      app.add_flag("--" + key, value, with_environment);
    } else {
      add_check(app.add_option("--" + key, value, with_environment)->capture_default_str(), check);
    }
  });
}

ServerConfig read_config(CLI::App& app, int argc, const char* const* argv) {
  ServerConfig of_flags;
  add_options(app, of_flags);
  std::string path = environment("MESHSMOOTH_CONFIG");
  app.add_option("--config", path,
                 "File with settings, as --print-config writes it (MESHSMOOTH_CONFIG)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ConversionError&) {  // below it gets better words
  } catch (const CLI::ValidationError&) {
  }

  ServerConfig config;
  if (!path.empty()) {
    for (const GivenSetting& given : given_by_file(path)) apply(config, given);
  }
  for (const GivenSetting& given : given_by_environment()) apply(config, given);
  for (const auto& [key, value] : list_settings({})) {
    for (const std::string& text : app.get_option("--" + key)->results()) {
      apply(config, {key, text, "flag --" + key});
    }
  }
  return config;
}

std::vector<GivenSetting> parse_config_file(std::istream& file, const std::string& name) {
  std::vector<GivenSetting> given;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    const std::string source = fmt::format("file {}, line {}", name, ++number);
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const std::size_t equals = std::min(line.find('='), line.size());
    GivenSetting setting{trim(line.substr(0, equals)), "", source};
    if (equals == line.size()) throw_wrong(setting.key, "no value (" + source + ")");
    const std::string right = trim(std::string_view(line).substr(equals + 1));
    std::string_view rest = right;
    const bool taken = take_value(rest, setting.value);
    const std::string behind = trim(rest);
    if (!taken || !(behind.empty() || behind.front() == '#')) {
      throw_wrong(setting.key, fmt::format("{} ({}) is neither a number, true, false nor a quoted "
                                           "string",
                                           right, source));
    }
    if (std::ranges::count(given, setting.key, &GivenSetting::key) > 0) {
      throw_wrong(setting.key, "it is said twice (" + source + ")");
    }
    given.push_back(std::move(setting));
  }
  return given;
}

std::vector<std::pair<std::string, SettingValue>> list_settings(const ServerConfig& config) {
  std::vector<std::pair<std::string, SettingValue>> list;
  visit_settings(
      config, [&list](const std::string& key, const auto& value, const std::string&, const auto&) {
        if constexpr (std::is_same_v<decltype(value), const int&>) {
          list.emplace_back(key, std::int64_t{value});
        } else {
          list.emplace_back(key, value);
        }
      });
  return list;
}

std::string describe(const ServerConfig& config) {
  std::string text;
  for (const auto& [key, value] : list_settings(config)) text += key + " = " + toml(value) + "\n";
  return text;
}

}  // namespace meshsmooth::server

#include "config.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>

#include "meshsmooth/error.hpp"
#include "settings.hpp"
#include "traces/trace_environment.hpp"

namespace meshsmooth::server {
namespace {

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

void apply(ServerConfig& config, const GivenSetting& given) {
  CLI::App app;
  app.set_help_flag();  // "help" is not a setting
  add_options(app, config);
  const std::string flag = "--" + given.key;
  if (app.get_option_no_throw(flag) == nullptr) {
    throw_wrong_setting(given.key, "there is no such setting (" + given.source + ")");
  }
  try {
    // CLI11 takes the arguments in reverse; an empty value must stand alone.
    app.parse(given.value.empty() ? std::vector<std::string>{given.value, flag}
                                  : std::vector<std::string>{flag + "=" + given.value});
  } catch (const CLI::ParseError& error) {
    std::string why = error.what();
    if (why.starts_with(flag + ": ")) why.erase(0, flag.size() + 2);
    throw_wrong_setting(given.key,
                        fmt::format("\"{}\" ({}) cannot be: {}", given.value, given.source, why));
  }
}

std::vector<GivenSetting> given_by_file(const std::string& path) {
  std::ifstream file(path);
  // A stream opens a folder, as container engines make where a mounted file is missing, too.
  if (!file || std::filesystem::is_directory(path)) {
    throw_wrong_setting("config", "cannot read the file " + path);
  }
  return parse_config_file(file, path);
}

std::vector<GivenSetting> given_by_environment() {
  std::vector<GivenSetting> given;
  for (const Setting& setting : settings()) {
    const std::string name = environment_name(setting.key);
    std::string text = environment(name);
    if (!text.empty()) given.push_back({setting.key, std::move(text), "environment, " + name});
  }
  return given;
}

/// Our clients' variables, and those that Kubernetes sets for Services named meshsmooth…
bool is_of_others(std::string_view name) {
  return name == "MESHSMOOTH_SERVER" || name == "MESHSMOOTH_SERVER_BINARY" ||
         name == "MESHSMOOTH_CLI" || name == "MESHSMOOTH_INSECURE" ||
         name.starts_with("MESHSMOOTH_CLIENT_") || name.find("_SERVICE_") != name.npos ||
         name.ends_with("_PORT") || name.find("_PORT_") != name.npos;
}

}  // namespace

std::vector<std::string> unknown_environment() {
  std::set<std::string> known = {"MESHSMOOTH_CONFIG"};
  for (const Setting& setting : settings()) known.insert(environment_name(setting.key));
  std::vector<std::string> unknown;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text = *variable;
    std::string name(text.substr(0, text.find('=')));
    const bool is_set = name.size() + 1 < text.size();
    if (name.starts_with("MESHSMOOTH_") && is_set && !known.contains(name) && !is_of_others(name)) {
      unknown.push_back(std::move(name));
    }
  }
  std::ranges::sort(unknown);
  return unknown;
}

void throw_wrong_setting(const std::string& field, const std::string& what) {
  throw InvalidOption("OPTION_OUT_OF_RANGE", field + ": " + what, {{"field", field}});
}

void add_options(CLI::App& app, ServerConfig& config) {
  for (const Setting& setting : settings()) {
    setting.add_flag(app, config, setting.text + " (" + environment_name(setting.key) + ")");
  }
}

void add_config_option(CLI::App& app, std::string& path) {
  app.add_option("--config", path,
                 "Configuration file, in the format of --print-config (MESHSMOOTH_CONFIG)");
}

ServerConfig read_config(CLI::App& app, int argc, const char* const* argv) {
  ServerConfig of_flags;
  add_options(app, of_flags);
  std::string path = environment("MESHSMOOTH_CONFIG");
  add_config_option(app, path);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ConversionError&) {  // reported below, with the source of the value
  } catch (const CLI::ValidationError&) {
  }

  ServerConfig config;
  if (!path.empty()) {
    for (const GivenSetting& given : given_by_file(path)) apply(config, given);
  }
  for (const GivenSetting& given : given_by_environment()) apply(config, given);
  for (const Setting& setting : settings()) {
    for (const std::string& text : app.get_option("--" + setting.key)->results()) {
      apply(config, {setting.key, text, "flag --" + setting.key});
    }
  }
  config.traces = read_trace_settings(environment);
  return config;
}

std::vector<std::pair<std::string, SettingValue>> list_settings(const ServerConfig& config) {
  std::vector<std::pair<std::string, SettingValue>> list;
  for (const Setting& setting : settings()) list.emplace_back(setting.key, setting.value(config));
  return list;
}

}  // namespace meshsmooth::server

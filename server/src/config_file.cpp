#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <type_traits>
#include <variant>

#include "config.hpp"

namespace meshsmooth::server {
namespace {

std::string trim(std::string_view text) {
  const auto is_space = [](unsigned char c) { return std::isspace(c) != 0; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

// What is wrong in a file is shown on a terminal.
bool is_text(std::string_view line) {
  return std::ranges::none_of(line, [](unsigned char c) { return std::iscntrl(c) && c != '\t'; });
}

/// Removes the value from the front of `text`; false when there is none.
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

std::vector<GivenSetting> parse_config_file(std::istream& file, const std::string& name) {
  std::vector<GivenSetting> given;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    const std::string source = fmt::format("file {}, line {}", name, ++number);
    line = trim(line);
    if (!is_text(line)) throw_wrong_setting("config", source + " is not text");
    if (line.empty() || line.front() == '#') continue;
    const std::size_t equals = std::min(line.find('='), line.size());
    GivenSetting setting{trim(line.substr(0, equals)), "", source};
    if (equals == line.size()) throw_wrong_setting(setting.key, "no value (" + source + ")");
    const std::string right = trim(std::string_view(line).substr(equals + 1));
    std::string_view rest = right;
    const bool taken = take_value(rest, setting.value);
    const std::string behind = trim(rest);
    if (!taken || !(behind.empty() || behind.front() == '#')) {
      throw_wrong_setting(setting.key,
                          fmt::format("{} ({}) is neither a number, true, false nor a quoted "
                                      "string",
                                      right, source));
    }
    if (std::ranges::count(given, setting.key, &GivenSetting::key) > 0) {
      throw_wrong_setting(setting.key, "duplicate setting (" + source + ")");
    }
    given.push_back(std::move(setting));
  }
  return given;
}

std::string describe(const ServerConfig& config) {
  std::string text;
  for (const auto& [key, value] : list_settings(config)) text += key + " = " + toml(value) + "\n";
  return text;
}

}  // namespace meshsmooth::server

#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "settings.hpp"

// What the parts of the table of settings are written with; included by them only.
namespace meshsmooth::server {

/// A size in bytes, of at least 0: 8GiB is understood.
struct Bytes {};

inline CLI::Validator text_that(const std::string& what, bool (*fits)(std::string_view),
                                const std::string& choices = "") {
  return {[=](std::string& text) { return fits(text) ? std::string() : "it is not " + what; },
          choices};
}

/// CLI11's own lets "nan" through, which is in no range.
inline CLI::Validator number_range(double lowest, double highest) {
  const CLI::Range range(lowest, highest);
  return {[range](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::isnan(value)) {
              return text + " is not a number";
            }
            return range(text);
          },
          range.get_description()};
}

inline CLI::Validator seconds_range() { return number_range(0.0, 1e6); }
inline CLI::Validator fraction() { return number_range(0.0, 1.0); }

inline bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

inline double to_seconds(ServerConfig::Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

inline CLI::Option* add_check(CLI::Option* option, const CLI::Validator& validator) {
  return option->check(validator);
}

inline CLI::Option* add_check(CLI::Option* option, Bytes) {
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

template <class T, class Check>
void add_flag(CLI::App& app, const std::string& flag, T& value, const std::string& text,
              const Check& check) {
  if constexpr (std::is_same_v<T, bool>) {
    app.add_flag(flag, value, text);
  } else if constexpr (std::is_same_v<T, ServerConfig::Duration>) {
    const auto set = [&value](double seconds) {
      value = std::chrono::nanoseconds(std::llround(seconds * 1e9));
    };
    CLI::Option* const option = app.add_option_function<double>(flag, set, text);
    add_check(option, check)->default_str(fmt::format("{}", to_seconds(value)));
  } else {
    add_check(app.add_option(flag, value, text)->capture_default_str(), check);
  }
}

template <class T>
SettingValue value_of(const T& value) {
  if constexpr (std::is_same_v<T, int>) {
    return std::int64_t{value};
  } else if constexpr (std::is_same_v<T, ServerConfig::Duration>) {
    return to_seconds(value);
  } else {
    return value;
  }
}

class Table {
 public:
  /// `check`: a CLI::Validator that describes the range, or `Bytes`.
  template <class T, class Check>
  Table& add(std::string key, T ServerConfig::*member, std::string text, const Check& check) {
    const std::string flag = "--" + key;
    settings_.push_back(
        {std::move(key), std::move(text),
         [flag, member, check](CLI::App& app, ServerConfig& config, const std::string& help) {
           server::add_flag(app, flag, config.*member, help, check);
         },
         [member](const ServerConfig& config) { return value_of(config.*member); }});
    return *this;
  }
  [[nodiscard]] std::vector<Setting> take() { return std::move(settings_); }

 private:
  std::vector<Setting> settings_;
};

// The parts of the table.
void add_connection_settings(Table& table);
void add_device_settings(Table& table);
void add_limit_settings(Table& table);
void add_time_settings(Table& table);
void add_stream_settings(Table& table);

}  // namespace meshsmooth::server

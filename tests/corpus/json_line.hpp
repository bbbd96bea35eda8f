#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

namespace meshsmooth::corpus {

/// One object of JSON on one line, written member by member.
class JsonLine {
 public:
  void add(std::string_view name, std::string_view text) { member(name) += quoted(text); }
  void add(std::string_view name, const char* text) { add(name, std::string_view(text)); }
  void add(std::string_view name, bool value) { member(name) += value ? "true" : "false"; }
  void add(std::string_view name, long long value) { member(name) += std::to_string(value); }
  void add(std::string_view name, double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.9g", value);
    member(name) += std::isfinite(value) ? digits : "null";
  }
  void add(std::string_view name, const JsonLine& object) { member(name) += object.text(); }

  [[nodiscard]] std::string text() const { return "{" + text_ + "}"; }

 private:
  std::string& member(std::string_view name) {
    if (!text_.empty()) text_ += ", ";
    return text_ += quoted(name) + ": ";
  }

  /// Bytes that are not ASCII stay as they are in the file they come from, which may not be UTF-8:
  /// they are replaced.
  static std::string quoted(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
      const auto code = static_cast<unsigned char>(c);
      if (code < 0x20 || code > 0x7e) {
        result += '?';
        continue;
      }
      if (c == '"' || c == '\\') result += '\\';
      result += c;
    }
    return result + "\"";
  }

  std::string text_;
};

}  // namespace meshsmooth::corpus

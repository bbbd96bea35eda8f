#include "log_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <type_traits>

namespace meshsmooth::server {
namespace {

bool is_plain(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return c > 0x20 && c < 0x7f && c != '"' && c != '=' && c != '\\';
  });
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const unsigned char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += static_cast<char>(c);
    } else if (c < 0x20 || c >= 0x7f) {
      result += fmt::format("\\u{:04x}", c);
    } else {
      result += static_cast<char>(c);
    }
  }
  return result + '"';
}

std::string number(const LogValue& value) {
  return std::visit(
      []<class T>(const T& v) {
        if constexpr (std::is_same_v<T, std::string>) {
          return v;
        } else {
          return fmt::format("{}", v);
        }
      },
      value);
}

}  // namespace

std::string to_text(const LogFields& fields) {
  std::string line;
  for (const auto& [key, value] : fields) {
    const auto* const text = std::get_if<std::string>(&value);
    if (!line.empty()) line += ' ';
    line += key + '=' + (text != nullptr && !is_plain(*text) ? quoted(*text) : number(value));
  }
  return line;
}

std::string to_json(const LogFields& fields) {
  std::string line;
  for (const auto& [key, value] : fields) {
    const auto* const text = std::get_if<std::string>(&value);
    if (!line.empty()) line += ',';
    line += quoted(key) + ':' + (text != nullptr ? quoted(*text) : number(value));
  }
  return line;
}

}  // namespace meshsmooth::server

#include "http/request.hpp"

#include <charconv>

#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

/// Of percent-encoding, and of forms' plus signs where `plus`.
std::string decode(std::string_view text, bool plus) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '+' && plus) {
      decoded += ' ';
    } else if (text[at] != '%') {
      decoded += text[at];
    } else {
      unsigned char byte = 0;
      const char* digits = text.data() + at + 1;
      if (at + 2 >= text.size() ||
          std::from_chars(digits, digits + 2, byte, 16).ptr != digits + 2) {
        throw Problem(400, "the address has a % without two hexadecimal digits");
      }
      decoded += static_cast<char>(byte);
      at += 2;
    }
  }
  return decoded;
}

}  // namespace

void read_target(std::string_view target, Request& request) {
  const std::size_t query = target.find('?');
  request.path = decode(target.substr(0, query), false);
  if (!request.path.starts_with('/')) throw Problem(400, "the address has no path");
  std::string_view left = query == std::string_view::npos ? "" : target.substr(query + 1);
  while (!left.empty()) {
    const std::size_t end = left.find('&');
    const std::string_view pair = left.substr(0, end);
    const std::size_t equals = pair.find('=');
    if (!pair.empty()) {
      request.parameters.emplace(
          decode(pair.substr(0, equals), true),
          equals == std::string_view::npos ? "" : decode(pair.substr(equals + 1), true));
    }
    left = end == std::string_view::npos ? "" : left.substr(end + 1);
  }
}

}  // namespace meshsmooth::gateway

// W3C's traceparent against its grammar as a regular expression.
#include <regex>
#include <string>

#include "fuzz/choices.hpp"
#include "wire/traceparent.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::regex grammar(
      "(?!ff)[0-9a-f]{2}-(?!0{32})[0-9a-f]{32}-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}(-[!-~]*)?");
  const std::string text(reinterpret_cast<const char*>(data), size);
  const bool expected = text.size() <= 128 && std::regex_match(text, grammar) &&
                        (text.size() == 55 || !text.starts_with("00"));
  meshsmooth::testing::require(meshsmooth::wire::is_traceparent(text) == expected, text);
  return 0;
}

// The numbers and words of `meshsmooth smooth`, a flag a line.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <vector>

#include "fuzz/choices.hpp"
#include "meshsmooth/error.hpp"
#include "smooth_options.hpp"
#include "wire/codec.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::require;

std::vector<std::string> flags_of(const std::string& text) {
  std::vector<std::string> flags;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) flags.push_back("--" + line);
  std::ranges::reverse(flags);  // as CLI11 takes them
  return flags;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  CLI::App app;
  cli::SmoothFlags flags;
  cli::add_smooth_flags(app, flags);
  try {
    app.parse(flags_of(text));
    const SmoothOptions options = cli::to_smooth_options(flags);
    validate(options);
    const v1::SmoothingOptions message = wire::encode_options(options);
    require(wire::encode_options(wire::decode_options(message)).SerializeAsString() ==
                message.SerializeAsString(),
            "a server understands what the flags say");
  } catch (const CLI::ParseError&) {
  } catch (const InvalidOption&) {
  } catch (const NotSupported&) {
  }
  return 0;
}

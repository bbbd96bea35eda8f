// The server's configuration: a file, or flags. First byte: which; flags are lines.
#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>
#include <vector>

#include "config.hpp"
#include "fuzz/choices.hpp"
#include "fuzz/scratch_file.hpp"
#include "meshsmooth/error.hpp"

namespace {

using namespace meshsmooth;
using namespace meshsmooth::server;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

ServerConfig read(std::vector<std::string> arguments) {
  CLI::App app;
  arguments.insert(arguments.begin(), "meshsmooth-server");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  return read_config(app, static_cast<int>(argv.size()), argv.data());
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    // A C string, and no file of this machine.
    if (line.find('\0') == std::string::npos && !line.starts_with("--config")) {
      lines.push_back(line);
    }
  }
  return lines;
}

void check(const ServerConfig& config, const testing::ScratchFiles& files) {
  for (const auto& [key, value] : list_settings(config)) {
    if (const auto* real = std::get_if<double>(&value)) {
      require(*real >= 0 && *real <= 1e6, key + " is in its range");
    } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
      require(*whole >= 0, key + " is not negative");
    } else if (const auto* text = std::get_if<std::string>(&value)) {
      require(text->find('\n') == std::string::npos, key + " is one line");
    }
  }
  const std::string path = files.write("printed", describe(config)).string();
  require(list_settings(read({"--config", path})) == list_settings(config),
          "--print-config says what was read");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const testing::ScratchFiles files;
  Choices choices({data, size});
  const bool is_file = choices.flag();
  const std::string text = choices.rest();
  try {
    check(is_file ? read({"--config", files.write("given", text).string()}) : read(lines_of(text)),
          files);
  } catch (const InvalidOption& error) {
    require(error.reason() == "OPTION_OUT_OF_RANGE" && !error.details().empty(),
            "a wrong value names its field");
  } catch (const CLI::ParseError&) {  // --help, and flags that do not exist
  }
  return 0;
}

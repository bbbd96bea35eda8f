#include "program.hpp"

#include <CLI/CLI.hpp>
#include <string>

#include "config.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/server_program.hpp"

namespace meshsmooth::server {
namespace {

std::string version_text(bool as_json) {
  if (!as_json) return MESHSMOOTH_VERSION;
  return R"({"version":")" MESHSMOOTH_VERSION R"(","commit":")" MESHSMOOTH_BUILD_COMMIT
         R"(","protocol":"meshsmooth.v1"})";
}

/// The program's command line with what it writes to.
struct Program {
  CLI::App app;
  ProgramFlags flags;
  ServerConfig config;
  std::string config_path;
};

}  // namespace

void add_program_flags(CLI::App& app, ProgramFlags& flags) {
  app.name("meshsmooth-server");
  app.description("Smooths finite-element meshes as a gRPC service (meshsmooth.v1).");
  // Before --version, which ends the parsing.
  app.add_flag("--json", flags.as_json,
               "With --version: print version, commit and protocol as JSON");
  app.set_version_flag(
      "--version", [&flags] { return version_text(flags.as_json); }, "Print the version and exit");
  app.add_flag("--print-config", flags.print_config,
               "Print all settings in effect, in the format of --config, and exit");
}

std::shared_ptr<CLI::App> make_program_app() {
  auto program = std::make_shared<Program>();
  add_program_flags(program->app, program->flags);
  add_options(program->app, program->config);
  add_config_option(program->app, program->config_path);
  return {program, &program->app};
}

}  // namespace meshsmooth::server

#include <fmt/ranges.h>
#include <CLI/Option.hpp>

#include <iostream>
#include <memory>

#include "commands.hpp"
#include "connection.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {
namespace {

struct InfoCommand {
  ServerAddress server;
  bool json = false;
};

ExitCode run(const InfoCommand& command) {
  const client::ServerInfo info = command.server.connect().server_info();
  if (command.json) {
    std::cout << info.json << std::endl;
    return ExitCode::done;
  }
  std::cout << fmt::format("version   {}{}\nmethods   {}\nfeatures  {}\nstate     {}\n",
                           info.version,
                           info.build_commit.empty() ? "" : " (" + info.build_commit + ")",
                           fmt::join(info.methods, ", "), fmt::join(info.features, ", "),
                           info.draining ? "draining: takes no new jobs" : "takes jobs")
            << std::flush;
  return ExitCode::done;
}

}  // namespace

void add_info_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<InfoCommand>();
  CLI::App* sub = app.add_subcommand("info", "Describe a server");
  add_server_flags(*sub, command->server);
  sub->add_flag("--json", command->json, "Output with limits and defaults, in proto3 JSON");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

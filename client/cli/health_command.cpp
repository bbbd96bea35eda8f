#include <CLI/Option.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "connection.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

void add_health_command(CLI::App& app, Action& action) {
  auto server = std::make_shared<ServerAddress>();
  CLI::App* sub = app.add_subcommand("health", "Check that a server serves: exit code 0 yes, 4 no");
  add_server_flags(*sub, *server);
  sub->callback([&action, server] {
    action = [server] {
      const bool serving = server->connect().healthy();
      std::cout << (serving ? "SERVING" : "NOT_SERVING") << std::endl;
      return serving ? ExitCode::done : ExitCode::refused;
    };
  });
}

}  // namespace meshsmooth::cli

#include <CLI/Option.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

void add_health_command(CLI::App& app, Action& action) {
  auto server = std::make_shared<std::string>();
  CLI::App* sub = app.add_subcommand("health", "Does a server serve? Exit code 0 yes, 4 no");
  sub->add_option("--server", *server, "HOST:PORT or unix:PATH")->required();
  sub->callback([&action, server] {
    action = [server] {
      const bool serving = client::Client(*server).healthy();
      std::cout << (serving ? "SERVING" : "NOT_SERVING") << std::endl;
      return serving ? ExitCode::done : ExitCode::refused;
    };
  });
}

}  // namespace meshsmooth::cli

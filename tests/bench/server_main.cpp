// server_bench: meshsmooth-bench's "first", "server" and "steps" where there is no CUDA to build
// that with.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <iostream>

#include "gpu/commands.hpp"

int main(int argc, char** argv) {
  CLI::App app("Measures the service on this machine.", "server_bench");
  app.require_subcommand(1);
  meshsmooth::bench::Action action;
  meshsmooth::bench::add_first_command(app, action);
  meshsmooth::bench::add_server_command(app, action);
  meshsmooth::bench::add_steps_command(app, action);
  meshsmooth::bench::add_transport_command(app, action);
  CLI11_PARSE(app, argc, argv);
  try {
    return action();
  } catch (const std::exception& error) {
    std::cerr << "server_bench: " << error.what() << std::endl;
    return 1;
  }
}

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <iostream>

#include "gpu/commands.hpp"

int main(int argc, char** argv) {
  using namespace meshsmooth::bench;
  CLI::App app(
      "Measures meshsmooth on a GPU, beside the paper's algorithms and other libraries.\n"
      "Exit codes: 0 done, 1 failed or results differ, 2 usage.");
  app.require_subcommand(1);
  Action action;
  add_first_command(app, action);
  add_kept_command(app, action);
  add_motions_command(app, action);
  add_paper_command(app, action);
  add_pipeline_command(app, action);
  add_result_hashes_command(app, action);
  add_server_command(app, action);
  add_steps_command(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "meshsmooth-bench: " << error.what() << std::endl;
    return 2;
  }
  try {
    return action();
  } catch (const std::exception& error) {
    std::cerr << "meshsmooth-bench: " << error.what() << std::endl;
    return 1;
  }
}

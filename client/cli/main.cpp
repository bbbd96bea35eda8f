#include <poll.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <csignal>
#include <iostream>

#include "commands.hpp"
#include "exit_code.hpp"
#include "manual_command.hpp"
#include "meshsmooth/error.hpp"

namespace {

using namespace meshsmooth::cli;

int report(const std::exception& error, ExitCode code, const std::string& form) {
  if (form == "json") {
    std::cerr << error_json(error, code) << std::endl;
  } else {
    std::cerr << "meshsmooth: " << error_line(error) << std::endl;
  }
  return static_cast<int>(code);
}

/// Whether all that was printed has arrived, or nobody wants to read it.
bool is_printed() {
  std::cout.flush();
  if (std::cout) return true;
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

}  // namespace

int main(int argc, char** argv) {
  // A file that grows too large and a pipe that nobody reads are errors of their writers, which
  // clean up.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app(
      "Smooths finite-element meshes: nodes move, nothing else changes, valid stays valid.\n"
      "Exit codes: 0 done, 1 failed, 2 usage, 3 bad mesh, 4 refused or unavailable, 5 deadline or "
      "cancelled, 6 short of what was asked: a motion reached in part, a requirement not met, "
      "files "
      "that differ in more than coordinates.");
  app.set_version_flag("--version", "meshsmooth " MESHSMOOTH_VERSION);
  std::string errors = "text";
  app.add_option("--errors", errors,
                 "Form of an error on the error output; json: an object in one line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.require_subcommand(1);
  Action action;
  add_smooth_command(app, action);
  add_move_command(app, action);
  add_quality_command(app, action);
  add_compare_command(app, action);
  add_generate_command(app, action);
  add_info_command(app, action);
  add_jobs_command(app, action);
  add_attach_command(app, action);
  add_cancel_command(app, action);
  add_health_command(app, action);
  add_bench_command(app, action);
  add_manual_commands(app, action, MESHSMOOTH_VERSION);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return report(error, ExitCode::usage, errors);
  }
  try {
    const ExitCode code = action();
    if (code == ExitCode::done && !is_printed()) {
      throw meshsmooth::Error("FILE_NOT_WRITABLE", "standard output: cannot write all of it");
    }
    return static_cast<int>(code);
  } catch (const std::exception& error) {
    return report(error, exit_code_of(error), errors);
  }
}

#include <CLI/Option.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "connection.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {
namespace {

struct CancelCommand {
  ServerAddress server;
  std::string job;
  bool keep_result = false;
};

ExitCode run(const CancelCommand& command) {
  const client::JobInfo job =
      command.server.connect().cancel_job(full_job_name(command.job), command.keep_result);
  std::cout << job.name << " is " << client::job_state_name(job.state) << std::endl;
  return ExitCode::done;
}

}  // namespace

void add_cancel_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<CancelCommand>();
  CLI::App* sub = app.add_subcommand("cancel", "Cancel a job of a server");
  sub->add_option("JOB", command->job, "Job name, as `meshsmooth jobs` prints it")->required();
  add_server_flags(*sub, command->server);
  sub->add_flag("--keep-result", command->keep_result,
                "Positions reached so far for the waiting caller, instead of an error");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

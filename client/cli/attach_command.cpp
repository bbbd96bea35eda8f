#include <CLI/Option.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "commands.hpp"
#include "connection.hpp"
#include "interrupt.hpp"
#include "job_output.hpp"
#include "mesh_file.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::cli {
namespace {

struct AttachCommand {
  ServerAddress server;
  std::string job;
  MeshArgument input;
  JobOutput output;
};

ExitCode run(const AttachCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  const Interrupt interrupt;
  const JobOutput output = checked_outputs(command.output, command.input);
  formats::MeshFile file = read_mesh(command.input);
  set_precision(output, file.mesh);
  interrupt.check();

  const KeptInput input = keep_input(output, command.input.path, file.mesh);
  client::Client client = command.server.connect();
  const client::SmoothReport report =
      run_call(output, file, {}, interrupt, {}, [&](const client::RequestOptions& request) {
        return client.attach(full_job_name(command.job), file.mesh, request);
      });
  write_result(output, input, file, report, wire::decode_options(report.message->options()), start);
  return ExitCode::done;
}

}  // namespace

std::string full_job_name(const std::string& name) {
  return name.starts_with("jobs/") ? name : "jobs/" + name;
}

void add_attach_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<AttachCommand>();
  CLI::App* sub =
      app.add_subcommand("attach", "Wait for a job sent with --result-ttl and write its result");
  sub->add_option("JOB", command->job, "Job name, as `meshsmooth jobs` prints it")->required();
  add_input_mesh(*sub, command->input, "IN",
                 "Mesh file that the job was sent with: " + formats::readable_extensions());
  add_server_flags(*sub, command->server);
  add_output_flags(*sub, command->output);
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

#include <fmt/format.h>
#include <CLI/Option.hpp>

#include <iostream>
#include <memory>

#include "commands.hpp"
#include "connection.hpp"
#include "meshsmooth/client.hpp"
#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

struct JobsCommand {
  ServerAddress server;
  bool json = false;
};

std::string situation(const client::JobInfo& job) {
  if (!job.error.empty()) return job.error;
  if (job.state == client::JobState::queued)
    return fmt::format("place {}", job.progress.queue_position);
  if (job.progress.iteration > 0) return fmt::format("iteration {}", job.progress.iteration);
  return job.progress.stage;
}

void print_table(const std::vector<client::JobInfo>& jobs) {
  std::size_t width = 4;
  for (const client::JobInfo& job : jobs) width = std::max(width, job.name.size());
  std::cout << fmt::format("{:<{}}  {:<9}  {:>13}  {:>13}  {}\n", "job", width, "state", "nodes",
                           "elements", "");
  for (const client::JobInfo& job : jobs) {
    std::cout << fmt::format("{:<{}}  {:<9}  {:>13}  {:>13}  {}\n", job.name, width,
                             client::job_state_name(job.state), with_commas(job.node_count),
                             with_commas(job.element_count), situation(job));
  }
  std::cout << std::flush;
}

void print_json(const std::vector<client::JobInfo>& jobs) {
  std::cout << "[";
  for (std::size_t i = 0; i < jobs.size(); ++i)
    std::cout << (i == 0 ? "\n" : ",\n") << jobs[i].json;
  std::cout << "]" << std::endl;
}

ExitCode run(const JobsCommand& command) {
  const std::vector<client::JobInfo> jobs = command.server.connect().list_jobs();
  if (command.json) {
    print_json(jobs);
  } else if (jobs.empty()) {
    std::cout << "no jobs" << std::endl;
  } else {
    print_table(jobs);
  }
  return ExitCode::done;
}

}  // namespace

void add_jobs_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<JobsCommand>();
  CLI::App* sub = app.add_subcommand("jobs", "List the jobs of a server, running and ended");
  add_server_flags(*sub, command->server);
  sub->add_flag("--json", command->json, "Output as a list of meshsmooth.v1.Job in proto3 JSON");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

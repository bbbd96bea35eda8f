#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace meshsmooth::bench {

/// What a subcommand does once the command line is understood; the exit code.
using Action = std::function<int()>;

void add_first_command(CLI::App& app, Action& action);
void add_kept_command(CLI::App& app, Action& action);
void add_motions_command(CLI::App& app, Action& action);
void add_paper_command(CLI::App& app, Action& action);
void add_pipeline_command(CLI::App& app, Action& action);
void add_result_hashes_command(CLI::App& app, Action& action);
void add_server_command(CLI::App& app, Action& action);
void add_steps_command(CLI::App& app, Action& action);
void add_transport_command(CLI::App& app, Action& action);

}  // namespace meshsmooth::bench

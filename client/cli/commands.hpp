#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <string>

#include "exit_code.hpp"

namespace meshsmooth::cli {

/// What a parsed command line asks for.
using Action = std::function<ExitCode()>;

/// Each adds one command; when the user chose it, parsing sets `action`.
void add_smooth_command(CLI::App& app, Action& action);
void add_move_command(CLI::App& app, Action& action);
void add_quality_command(CLI::App& app, Action& action);
void add_compare_command(CLI::App& app, Action& action);
void add_generate_command(CLI::App& app, Action& action);
void add_info_command(CLI::App& app, Action& action);
void add_jobs_command(CLI::App& app, Action& action);
void add_cancel_command(CLI::App& app, Action& action);
void add_health_command(CLI::App& app, Action& action);
void add_attach_command(CLI::App& app, Action& action);
void add_bench_command(CLI::App& app, Action& action);

/// "jobs/ID" of "jobs/ID" or "ID".
[[nodiscard]] std::string full_job_name(const std::string& name);

}  // namespace meshsmooth::cli

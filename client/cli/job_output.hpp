#pragma once

#include <CLI/App.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "html_report.hpp"
#include "interrupt.hpp"
#include "mesh_argument.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/client.hpp"
#include "progress_display.hpp"

namespace meshsmooth::cli {

/// What the commands that receive a result share: where it goes and how it is shown.
struct JobOutput {
  MeshArgument output;
  std::optional<std::string> precision;
  std::optional<std::filesystem::path> report;
  std::optional<std::filesystem::path> html;
  std::optional<double> timeout_seconds;
  std::string progress = "text";
  bool quiet = false;
};

/// Adds the flags to a command; `job` must outlive it.
void add_output_flags(CLI::App& command, JobOutput& job);

/// The outputs with the format that `input` gives them. Where one is standard output, it alone goes
/// there. Throws `Error` (FILE_NOT_WRITABLE; FORMAT_UNKNOWN, also where `input` cannot be written
/// so) or `InvalidOption` (OPTION_MISPLACED) before any work is done.
[[nodiscard]] JobOutput checked_outputs(JobOutput job, const MeshArgument& input);

/// Converts the positions to the precision that was asked for; they travel and are computed in it.
void set_precision(const JobOutput& job, Mesh& mesh);

/// What the HTML report needs of the input; empty where none is to be written.
[[nodiscard]] KeptInput keep_input(const JobOutput& job, const std::filesystem::path& path,
                                   const Mesh& mesh);

/// Runs `call` with timeout, progress and cancellation of this command in its request. Errors name
/// elements and nodes as the file does.
[[nodiscard]] client::SmoothReport run_call(
    const JobOutput& job, const formats::MeshFile& file, ProgressDisplay::Goal goal,
    const Interrupt& interrupt, client::RequestOptions request,
    const std::function<client::SmoothReport(const client::RequestOptions&)>& call);

/// Writes mesh and reports, then prints the summary unless quiet. `start`: of the command.
void write_result(const JobOutput& job, const KeptInput& input, formats::MeshFile& file,
                  const client::SmoothReport& report, const SmoothOptions& options,
                  std::chrono::steady_clock::time_point start);

}  // namespace meshsmooth::cli

#include "job_output.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <utility>
#include <variant>
#include <vector>

#include "add_flag.hpp"
#include "input_mesh.hpp"
#include "smooth_options.hpp"
#include "summary_report.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

template <class To, class From>
void convert_positions(Mesh& mesh) {
  const auto* from = std::get_if<std::vector<From>>(&mesh.positions);
  if (from == nullptr) return;
  std::vector<To> converted(from->size());
  std::ranges::transform(*from, converted.begin(),
                         [](From position) { return vec3_cast<decltype(To::x)>(position); });
  mesh.positions = std::move(converted);
}

}  // namespace

void add_output_flags(CLI::App& command, JobOutput& job) {
  command
      .add_option("-o,--output", job.output.path,
                  "Output file: " + output_help(formats::writable_extensions()))
      ->required();
  add_output_format(command, job.output.format);
  command
      .add_option("--precision", job.precision,
                  "Precision of coordinates in transfer, computation and output [the file's]")
      ->check(CLI::IsMember({"f32", "f64"}));
  command.add_option("--report", job.report, "Output file of the whole summary, as JSON");
  command.add_option("--html", job.html, "Output file of an HTML report with an interactive view");
  add_flag(command, flag::timeout, job.timeout_seconds)->check(CLI::Range(1e-3, 1e9));
  command
      .add_option("--progress", job.progress,
                  "Form of the progress on the error output; json: an object in each line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command.add_flag("--quiet", job.quiet, "No output but errors");
}

JobOutput checked_outputs(JobOutput job, const MeshArgument& input) {
  job.output = output_beside(job.output, input);
  formats::check_writable(job.output.path, source_of(input), job.output.format);
  std::vector<std::pair<std::string, fs::path>> files = {{"--output", job.output.path}};
  if (job.report) files.emplace_back("--report", *job.report);
  if (job.html) files.emplace_back("--html", *job.html);
  const auto full = [](const fs::path& path) { return fs::absolute(path).lexically_normal(); };
  for (std::size_t n = 1; n < files.size(); ++n) {
    for (std::size_t m = 0; m < n; ++m) {
      if (full(files[n].second) != full(files[m].second)) continue;
      throw InvalidOption("OPTION_MISPLACED",
                          files[n].first + " and " + files[m].first + " name the same file",
                          {{"field", files[n].first}});
    }
    check_text_file_writable(files[n].second);
  }
  keep_standard_output(files);
  return job;
}

KeptInput keep_input(const JobOutput& job, const fs::path& path, const Mesh& mesh) {
  return job.html ? KeptInput{path, mesh.positions} : KeptInput{};
}

void set_precision(const JobOutput& job, Mesh& mesh) {
  if (job.precision == "f32") convert_positions<Vec3f, Vec3d>(mesh);
  if (job.precision == "f64") convert_positions<Vec3d, Vec3f>(mesh);
}

client::SmoothReport run_call(
    const JobOutput& job, const formats::MeshFile& file, ProgressDisplay::Goal goal,
    const Interrupt& interrupt, client::RequestOptions request,
    const std::function<client::SmoothReport(const client::RequestOptions&)>& call) {
  using Form = ProgressDisplay::Form;
  ProgressDisplay display(std::cerr, ::isatty(STDERR_FILENO) == 1, goal,
                          ProgressDisplay::Clock::now,
                          job.progress == "json" ? Form::json : Form::text);
  request.stop = interrupt.token();
  if (job.timeout_seconds) request.timeout = to_duration("--timeout", *job.timeout_seconds);
  if (!job.quiet) {
    request.on_progress = [&](const client::JobProgress& progress) { display.show(progress); };
  }
  try {
    client::SmoothReport report = call(request);
    display.finish();
    return report;
  } catch (const client::ServiceError& error) {
    display.finish();
    throw client::ServiceError(error.code(), error.reason(),
                               error.what() + place_in_file(error.details(), file), error.details(),
                               error.hint());
  }
}

void write_result(const JobOutput& job, const KeptInput& input, formats::MeshFile& file,
                  const client::SmoothReport& report, const SmoothOptions& options,
                  std::chrono::steady_clock::time_point start) {
  const std::string json = job.report ? report.to_json() : "";  // first, should it have none
  file.element_quality = report.summary.element_quality;
  formats::write_mesh_file(job.output.path, file, job.output.format);
  if (job.report) write_text_file(*job.report, json);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  if (job.html) {
    write_text_file(*job.html,
                    job_html(input, job.output.path, file, report, options, elapsed.count()));
  }
  if (job.quiet) return;
  std::cout << describe_summary(report, options, elapsed.count(), [&](std::int64_t id) {
    return file.file_element_id(id);
  }) << std::flush;
}

}  // namespace meshsmooth::cli

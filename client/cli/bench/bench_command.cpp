#include <fmt/format.h>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>

#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "bench/load.hpp"
#include "bench/load_generator.hpp"
#include "commands.hpp"
#include "connection.hpp"
#include "interrupt.hpp"
#include "readable.hpp"
#include "smooth_options.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

struct BenchCommand {
  LoadSettings load;
  SmoothFlags smoothing;
  std::optional<std::string> json;
};

void print(const BenchCommand& command, const LoadGenerator& load, const LoadFigures& f) {
  const std::string kind = command.load.rate
                               ? fmt::format("open loop, {} jobs/s due", *command.load.rate)
                               : fmt::format("closed loop, {} clients", command.load.client_count);
  std::string sizes;
  for (const LoadMesh& mesh : load.meshes()) {
    sizes += fmt::format("{}{} nodes ({:.2f} MB up)", sizes.empty() ? "" : ", ",
                         with_commas(static_cast<std::int64_t>(mesh.mesh.node_count())),
                         1e-6 * static_cast<double>(mesh.bytes_up));
  }
  std::cout << fmt::format("{}; {}\n", kind, sizes);
  std::cout << fmt::format("{}, measured over {:.1f} s\n",
                           load.steady() ? "steady: three windows within 10 %" : "NOT steady",
                           f.seconds);
  std::cout << fmt::format("{:>10}  {:>8}  {:>9}  {:>8}  {:>8}  {:>8}  {:>8}  {:>8}\n", "jobs/s",
                           "MB/s up", "MB/s down", "p50 ms", "p90 ms", "p99 ms", "p99.9 ms",
                           "max ms");
  std::cout << fmt::format(
      "{:>10.1f}  {:>8.1f}  {:>9.1f}  {:>8.2f}  {:>8.2f}  {:>8.2f}  {:>8.2f}  {:>8.2f}\n",
      f.jobs_per_second, f.megabytes_up_per_second, f.megabytes_down_per_second, 1e3 * f.p50,
      1e3 * f.p90, 1e3 * f.p99, 1e3 * f.p999, 1e3 * f.max);
  std::cout << fmt::format("ok {}, refused {}, failed {}", f.ok_count, f.refused_count,
                           f.failed_count);
  if (load.unsent_count() > 0) {
    std::cout << fmt::format(", never sent {} (as many as allowed were under way)",
                             load.unsent_count());
  }
  std::cout << "\n";
  for (const auto& [reason, count] : f.refused)
    std::cout << "  refused " << reason << " " << count << "\n";
  for (const auto& [reason, count] : f.failed)
    std::cout << "  failed " << reason << " " << count << "\n";
  std::cout << std::flush;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return result + '"';
}

std::string to_json(const BenchCommand& command, const LoadGenerator& load, const LoadFigures& f) {
  const auto counts = [](const std::map<std::string, std::int64_t>& by_reason) {
    std::string text;
    for (const auto& [reason, count] : by_reason) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", quoted(reason), count);
    }
    return "{" + text + "}";
  };
  std::string sizes;
  for (const std::string& size : command.load.sizes)
    sizes += (sizes.empty() ? "" : ", ") + quoted(size);
  return fmt::format(
      "{{\n  \"loop\": \"{}\",\n  \"client_count\": {},\n  \"due_jobs_per_second\": {},\n"
      "  \"nodes\": [{}],\n  \"steady\": {},\n  \"window_count\": {},\n  \"seconds\": {},\n"
      "  \"jobs_per_second\": {},\n  \"megabytes_up_per_second\": {},\n"
      "  \"megabytes_down_per_second\": {},\n  \"latency_seconds\": {{\"p50\": {}, \"p90\": {}, "
      "\"p99\": {}, \"p99.9\": {}, \"max\": {}}},\n  \"ok\": {},\n  \"refused\": {},\n"
      "  \"refused_by_reason\": {},\n  \"failed\": {},\n  \"failed_by_reason\": {},\n"
      "  \"unsent\": {},\n  \"unfinished\": {}\n}}\n",
      command.load.rate ? "open" : "closed", command.load.rate ? 0 : command.load.client_count,
      command.load.rate.value_or(0), sizes, load.steady(), load.window_count(), f.seconds,
      f.jobs_per_second, f.megabytes_up_per_second, f.megabytes_down_per_second, f.p50, f.p90,
      f.p99, f.p999, f.max, f.ok_count, f.refused_count, counts(f.refused), f.failed_count,
      counts(f.failed), load.unsent_count(), load.unfinished_count());
}

ExitCode run(const BenchCommand& command) {
  const Interrupt interrupt;
  const SmoothOptions options = to_smooth_options(command.smoothing);
  (void)command.load.server.connect().server_info();  // no figures without a server
  LoadGenerator load(command.load, options, interrupt.token());
  load.run();
  const LoadFigures figures = load.figures();
  print(command, load, figures);
  if (command.json) write_text_file(*command.json, to_json(command, load, figures));
  if (interrupt.token().stop_requested()) return ExitCode::stopped;
  return figures.ok_count > 0 ? ExitCode::done : ExitCode::failed;
}

}  // namespace

void add_bench_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<BenchCommand>();
  CLI::App* sub = app.add_subcommand(
      "bench",
      "Load-test a server and report its sustained throughput. Ends when three windows are within "
      "10 %, at a limit or on Ctrl-C, and reports in any case");
  add_server_flags(*sub, command->load.server);
  CLI::Option* clients =
      sub->add_option("--clients", command->load.client_count,
                      "Clients of a closed loop: each sends its next job after the last")
          ->check(CLI::Range(1, 10'000))
          ->capture_default_str();
  sub->add_option("--rate", command->load.rate,
                  "Rate of an open loop, in jobs per second, however they end")
      ->check(CLI::Range(1e-3, 1e6))
      ->excludes(clients);
  sub->add_option("--max-in-flight", command->load.max_in_flight,
                  "Jobs in flight of an open loop; what is due beyond is counted as never sent")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  sub->add_option("--nodes", command->load.sizes,
                  "Mesh sizes (a pipe of tetrahedra), NODES or NODES:WEIGHT")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_flag("--single", command->load.single, "Positions in float32");
  sub->add_option("--window", command->load.window_seconds, "Length of a window, in seconds")
      ->check(CLI::Range(0.05, 3600.0))
      ->capture_default_str();
  sub->add_option("--seconds", command->load.max_seconds, "Time limit, in seconds")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  sub->add_option("--jobs", command->load.max_jobs, "Job limit")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{100'000'000}))
      ->capture_default_str();
  sub->add_option("--seed", command->load.seed, "Seed of the random numbers")
      ->capture_default_str();
  sub->add_option("--json", command->json, "Output file of the figures, as JSON");
  add_smooth_flags(*sub, command->smoothing);
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

#include <CLI/App.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>

#include "gpu/commands.hpp"
#include "gpu/device_info.hpp"
#include "paper/measure.hpp"
#include "paper/published.hpp"
#include "paper/tables.hpp"

namespace meshsmooth::bench {
namespace {

struct PaperCommand {
  std::vector<std::string> meshes = {"5k", "10k", "50k", "100k", "slope77k"};
  std::filesystem::path json;
  std::filesystem::path cache;
  int repeats = 5;
  bool cpu_only = false;
};

/// A cube of that many nodes: "5k", "1M", "1234"; with "slope" before it the slope.
BenchMesh make_named(std::string_view name, const std::filesystem::path& cache) {
  constexpr std::string_view kSlope = "slope";
  const bool slope = name.starts_with(kSlope);
  const std::string_view size = slope ? name.substr(kSlope.size()) : name;
  std::size_t count = 0;
  const char* const end = size.data() + size.size();
  const auto [rest, error] = std::from_chars(size.data(), end, count);
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  if (error != std::errc() || (unit != "" && unit != "k" && unit != "M")) {
    throw std::runtime_error("mesh '" + std::string(name) +
                             "': give a number of nodes, as 5k or slope77k");
  }
  if (unit == "k") count *= 1000;
  if (unit == "M") count *= 1'000'000;
  return slope ? make_slope(count, cache) : make_cube(count, cache);
}

Json published_json() {
  Json json;
  for (const published::Figure& figure : published::kFigures) {
    Json entry;
    entry.set("mesh", std::string(figure.mesh))
        .set("quantity", std::string(figure.quantity))
        .set("value", figure.value);
    json.push(std::move(entry));
  }
  return json;
}

int run(const PaperCommand& command) {
  const DeviceInfo device = find_device();
  if (device.name.empty() && !command.cpu_only) {
    std::cerr << "meshsmooth-bench: there is no CUDA device or driver; --cpu-only runs the serial "
                 "algorithm\n";
    return 1;
  }
  PaperSettings settings;
  settings.repeats = command.repeats;
  settings.with_gpu = !command.cpu_only;
  if (settings.with_gpu) {
    std::cout << "device: " << device.name << ", " << device.multiprocessor_count
              << " multiprocessors" << std::endl;
  }

  std::vector<PaperFigures> all;
  Json meshes;
  bool failed = false;
  for (const std::string& name : command.meshes) {
    const BenchMesh mesh = make_named(name, command.cache);
    std::cerr << "measuring " << mesh.name << std::endl;
    HostTopology host;
    all.push_back(measure_paper(mesh, settings, host));
    for (const std::string& error : all.back().errors) {
      std::cerr << "MISMATCH " << error << std::endl;
      failed = true;
    }
    meshes.push(to_json(all.back()));
    Json json;
    json.set("benchmark", "paper")
        .set("repeats", command.repeats)
        .set("published_machine", std::string(published::kMachine))
        .set("published", published_json());
    if (settings.with_gpu) json.set("device", to_json(device));
    // After every mesh: a run that is cut short leaves what it measured.
    write_json(command.json, json.set("meshes", meshes).set("failed", failed));
  }
  print_tables(std::cout, all);
  return failed ? 1 : 0;
}

}  // namespace

void add_paper_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<PaperCommand>();
  CLI::App* sub = app.add_subcommand(
      "paper", "The system of Xiao, Yang, Zhao, Mei 2019: its tables, and what we found");
  sub->add_option("--meshes", command->meshes, "Cubes by number of nodes, slopes as slope77k")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_option("--json", command->json, "Writes everything measured here");
  sub->add_option("--cache", command->cache, "Keeps the meshes in this directory");
  sub->add_option("--repeat", command->repeats, "Timed runs of each variant")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  sub->add_flag("--cpu-only", command->cpu_only, "The serial algorithm alone");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::bench

#include <CLI/App.hpp>
#include <chrono>
#include <iostream>
#include <memory>

#include "gpu/commands.hpp"
#include "gpu/product.hpp"

namespace meshsmooth::bench {
namespace {

struct Task {
  std::string name;
  SmoothOptions options;
};

/// A step of a moving mesh, and whole jobs.
std::vector<Task> tasks() {
  const auto brief = [](Method method, std::optional<int> sweeps, bool guard) {
    SmoothOptions options;
    options.method = method;
    options.guard = guard;
    options.never_worse = false;
    options.max_iterations = sweeps;
    if (sweeps && !std::holds_alternative<Optimize>(method)) {
      options.tolerance = {.value = 0, .relative = false};
    }
    options.quality_detail = QualityDetail::brief;
    return options;
  };
  return {{"laplacian, 3 sweeps", brief(Laplacian{}, 3, false)},
          {"laplacian, 3 guarded sweeps", brief(Laplacian{}, 3, true)},
          {"taubin, 3 guarded sweeps", brief(Taubin{}, 3, true)},
          {"hc-laplacian, 3 guarded sweeps", brief(HcLaplacian{}, 3, true)},
          {"smart-laplacian, 20 sweeps", brief(SmartLaplacian{}, 20, true)},
          {"optimize, 3 sweeps", brief(Optimize{}, 3, true)},
          {"optimize", SmoothOptions{}}};
}

struct Kept {
  std::shared_ptr<const PreparedTopology> topology;
  double prepare_ms = 0;
};

Kept prepare(Smoother& smoother, const PinnedTopology& topology) {
  constexpr int kRepeats = 5;
  Kept kept;
  std::vector<double> times;
  for (int run = 0; run < kRepeats; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    kept.topology = smoother.prepare(topology.view());
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - begin;
    times.push_back(elapsed.count());
  }
  kept.prepare_ms = median(times);
  return kept;
}

template <class Real>
void measure(Smoother& smoother, const BenchMesh& mesh, const PinnedTopology& topology,
             const Kept& kept, int repeats, Table& table, Json& json) {
  PinnedPositions<Real> positions(mesh);
  const std::string type = sizeof(Real) == sizeof(float) ? "f32" : "f64";
  for (const Task& task : tasks()) {
    const ProductFigures whole =
        measure_product(smoother, topology, positions, task.options, repeats);
    const ProductFigures step =
        measure_product(smoother, topology, positions, task.options, repeats, kept.topology.get());
    table.add({mesh.name, type, task.name, number(whole.wall_ms), number(step.wall_ms),
               ratio(whole.wall_ms / step.wall_ms), number(step.upload_ms),
               number(step.boundary_ms), number(step.iterate_ms), number(step.evaluate_ms),
               number(step.download_ms), std::to_string(step.summary.convergence.iteration_count)});
    Json row;
    row.set("mesh", mesh.name)
        .set("type", type)
        .set("task", task.name)
        .set("whole", to_json(whole))
        .set("kept", to_json(step));
    json.push(std::move(row));
  }
}

int run(const std::string& backend, const std::filesystem::path& cache,
        const std::filesystem::path& json_file) {
  const auto smoother = make_smoother(backend);
  Table table({"mesh", "type", "task", "whole ms", "kept ms", "faster", "up", "nodes", "iterate",
               "evaluate", "down", "sweeps"});
  Json rows, prepared;
  for (const std::size_t nodes : {5'000UL, 100'000UL, 1'000'000UL}) {
    const BenchMesh mesh = make_cube(nodes, cache);
    const PinnedTopology topology(mesh);
    const Kept kept = prepare(*smoother, topology);
    const MemoryEstimate bytes = kept.topology->bytes();
    std::cout << mesh.name << ": preparing takes " << number(kept.prepare_ms) << " ms and keeps "
              << number(static_cast<double>(bytes.device_bytes + bytes.host_bytes) / 1e6) << " MB"
              << std::endl;
    Json row;
    row.set("mesh", mesh.name)
        .set("prepare_ms", kept.prepare_ms)
        .set("bytes", bytes.device_bytes + bytes.host_bytes);
    prepared.push(std::move(row));
    const int repeats = nodes > 500'000 ? 9 : 25;
    measure<float>(*smoother, mesh, topology, kept, repeats, table, rows);
    measure<double>(*smoother, mesh, topology, kept, repeats, table, rows);
  }
  std::cout << "\nA job that brings its topology, and one on a kept one; from and to page-locked "
               "memory, medians, ms\n";
  table.print(std::cout);
  Json json;
  json.set("backend", std::string(smoother->backend()))
      .set("prepared", std::move(prepared))
      .set("rows", std::move(rows));
  write_json(json_file, json);
  return 0;
}

}  // namespace

void add_kept_command(CLI::App& app, Action& action) {
  struct Options {
    std::string backend = "cuda:0";
    std::filesystem::path cache, json;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* const command = app.add_subcommand("kept", "jobs on a kept topology beside whole ones");
  command->add_option("--backend", options->backend, "backend")->capture_default_str();
  command->add_option("--cache", options->cache, "folder where meshes are kept");
  command->add_option("--json", options->json, "file for the figures");
  command->callback([&action, options] {
    action = [options] { return run(options->backend, options->cache, options->json); };
  });
}

}  // namespace meshsmooth::bench

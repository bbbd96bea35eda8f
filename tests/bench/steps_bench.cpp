// A time-step loop through the service: a mesh whose nodes move, sent whole each time or by the
// name of its topology, over TCP or shared memory; and the method move, whose boundary alone moves.

#include <grpcpp/create_channel.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client_access.hpp"
#include "gpu/commands.hpp"
#include "gpu/report.hpp"
#include "host_memory.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"
#include "support/meshes.hpp"
#include "support/relay.hpp"

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Settings {
  std::string backend = "cpu";
  int node_count = 100'000;
  int step_count = 100;
  int sweep_count = 3;
  bool guard = true;
  bool optimize = false;
  bool full_quality_detail = false;
  std::string json;
};

/// A jittered cube of tetrahedra, its nodes in no order, as mesh generators leave them.
Mesh make_mesh(int node_count) {
  const int cells = std::max(1, static_cast<int>(std::lround(std::cbrt(node_count))) - 1);
  Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, cells), 0.15, 1);
  std::vector<NodeId> place(mesh.node_count());
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), std::mt19937(2));
  std::vector<Vec3d> shuffled(mesh.node_count());
  for (std::size_t node = 0; node < place.size(); ++node) {
    shuffled[static_cast<std::size_t>(place[node])] = test::points(mesh)[node];
  }
  for (NodeId& node : mesh.blocks[0].nodes) node = place[static_cast<std::size_t>(node)];
  mesh.positions = std::move(shuffled);
  return mesh;
}

/// Where the nodes are at a step: a wave runs through the cube.
std::vector<Vec3d> positions_at(const Mesh& mesh, int step) {
  std::vector<Vec3d> positions = test::points(mesh);
  const double phase = 0.1 * step;
  const double size = std::cbrt(static_cast<double>(mesh.node_count()));
  for (Vec3d& p : positions) p.x += 0.01 * size * std::sin(6 * p.z / size + phase);
  return positions;
}

SmoothOptions options_of(const Settings& settings) {
  if (settings.optimize) return {};
  SmoothOptions options;
  options.method = Laplacian{};
  options.guard = settings.guard;
  options.never_worse = false;
  options.max_iterations = settings.sweep_count;
  options.tolerance = {0, false};
  if (!settings.full_quality_detail) options.quality_detail = QualityDetail::brief;
  return options;
}

/// Where the time of a step goes, as the server says.
using Stage = std::pair<const char*, double (*)(const client::SmoothReport&)>;
constexpr std::array<Stage, 9> kStages = {{
    {"receive", [](const client::SmoothReport& r) { return r.receive_seconds; }},
    {"queue", [](const client::SmoothReport& r) { return r.queue_seconds; }},
    {"upload", [](const client::SmoothReport& r) { return r.summary.times.upload_seconds; }},
    {"neighbours",
     [](const client::SmoothReport& r) { return r.summary.times.find_neighbours_seconds; }},
    {"boundary",
     [](const client::SmoothReport& r) { return r.summary.times.find_boundary_seconds; }},
    {"iterate", [](const client::SmoothReport& r) { return r.summary.times.iterate_seconds; }},
    {"evaluate", [](const client::SmoothReport& r) { return r.summary.times.evaluate_seconds; }},
    {"download", [](const client::SmoothReport& r) { return r.summary.times.download_seconds; }},
    {"send", [](const client::SmoothReport& r) { return r.send_seconds; }},
}};

struct Figures {
  double median_ms = 0, total_seconds = 0;
  std::array<double, kStages.size()> stage_ms{};  // medians
};

/// Runs `step(positions)` for all steps, the first not counted; `prepare(positions)` is not timed.
template <class Step, class Prepare>
Figures measure(const Settings& settings, const Mesh& mesh, const Step& step,
                const Prepare& prepare) {
  std::vector<double> times;
  std::array<std::vector<double>, kStages.size()> stages;
  for (int i = 0; i <= settings.step_count; ++i) {
    std::vector<Vec3d> positions = positions_at(mesh, i);
    prepare(positions);
    const auto start = Clock::now();
    const client::SmoothReport report = step(positions);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (i == 0) continue;
    times.push_back(seconds);
    for (std::size_t s = 0; s < kStages.size(); ++s) {
      stages[s].push_back(kStages[s].second(report));
    }
  }
  Figures figures{median(times) * 1e3, std::accumulate(times.begin(), times.end(), 0.0)};
  for (std::size_t s = 0; s < kStages.size(); ++s) figures.stage_ms[s] = median(stages[s]) * 1e3;
  return figures;
}

template <class Step>
Figures measure(const Settings& settings, const Mesh& mesh, const Step& step) {
  return measure(settings, mesh, step, [](const std::vector<Vec3d>&) {});
}

server::ServerConfig server_config(const Settings& settings, const std::string& listen) {
  return {.listen = listen,
          .backend = settings.backend,
          .lanes = 1,
          .lame_duck = std::chrono::seconds(0),
          .log_level = "off"};
}

/// Steps of the boundary alone, by less than an edge: the rest follows.
auto by_move(client::Session& session, const std::vector<NodeId>& boundary, bool full) {
  SmoothOptions options{.method = Move{}};
  if (!full) options.quality_detail = QualityDetail::brief;
  return [&session, &boundary, options](const std::vector<Vec3d>& positions) {
    std::vector<Vec3d> there(boundary.size());
    std::ranges::transform(boundary, there.begin(),
                           [&](NodeId n) { return positions[static_cast<std::size_t>(n)]; });
    return session.move(boundary, std::span<const Vec3d>(there), options);
  };
}

void run(const Settings& settings) {
  server::Server server(server_config(settings, "127.0.0.1:0"));
  server.start();
  const std::string address = "127.0.0.1:" + std::to_string(server.port());
  const Mesh mesh = make_mesh(settings.node_count);
  const SmoothOptions options = options_of(settings);
  const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(mesh).view());

  const auto whole = [&](client::Client& client, Mesh& sent) {
    return [&](std::vector<Vec3d>& positions) {
      sent.positions = std::move(positions);
      return client.smooth(sent, options);
    };
  };
  const auto by_name = [&](client::Session& session) {
    return [&](std::vector<Vec3d>& positions) { return session.smooth(positions, options); };
  };
  client::Client client(address);
  Mesh sent = mesh;
  client::Session session = client.open(mesh);
  const Figures sent_whole = measure(settings, mesh, whole(client, sent));
  const Figures named = measure(settings, mesh, by_name(session));
  const Figures moved =
      measure(settings, mesh, by_move(session, boundary, settings.full_quality_detail));

  const std::string socket = "meshsmooth-steps-" + std::to_string(getpid());
  const std::string local = "unix:" + (std::filesystem::temp_directory_path() / socket).string();
  server::Server near(server_config(settings, local));
  near.start();
  client::Client beside(local);
  client::Session shared = beside.open(mesh);
  const Figures shared_whole = measure(settings, mesh, whole(beside, sent));
  const Figures shared_named = measure(settings, mesh, by_name(shared));
  const Figures shared_in_place = measure(
      settings, mesh, [&](const std::vector<Vec3d>&) { return shared.smooth(options); },
      [&](const std::vector<Vec3d>& positions) {
        std::ranges::copy(positions, std::get<std::span<Vec3d>>(shared.positions_span()).begin());
      });
  const Figures shared_moved =
      measure(settings, mesh, by_move(shared, boundary, settings.full_quality_detail));

  // What passes the wire, counted by a relay that would cost time above.
  const auto bytes_up = [&](const auto& make_step) {
    testing::Relay relay(server.port());
    client::Client counted(relay.target());
    auto step = make_step(counted);
    const auto once = [&](int i) {
      std::vector<Vec3d> positions = positions_at(mesh, i);
      step(positions);
    };
    once(0);
    const std::int64_t before = relay.bytes_up();
    constexpr int kSteps = 5;
    for (int i = 1; i <= kSteps; ++i) once(i);
    return static_cast<double>(relay.bytes_up() - before) / kSteps /
           static_cast<double>(mesh.node_count());
  };
  const double whole_bytes = bytes_up([&](client::Client& c) { return whole(c, sent); });
  std::optional<client::Session> counted;
  const double named_bytes = bytes_up([&](client::Client& c) {
    counted.emplace(c.open(mesh));
    return by_name(*counted);
  });

  std::cout << mesh.node_count() << " nodes, " << mesh.element_count() << " tetrahedra, "
            << settings.step_count << " steps of "
            << (settings.optimize ? "optimize" : std::to_string(settings.sweep_count) + " sweeps")
            << ", backend " << settings.backend << "\n";
  struct Row {
    const char* name;
    const char* key;
    const Figures& figures;
    std::optional<double> bytes;
  };
  const Row rows[] = {
      {"mesh sent each time", "whole", sent_whole, whole_bytes},
      {"topology by name", "named", named, named_bytes},
      {"move, reference by name", "moved", moved, {}},
      {"mesh in shared memory", "shared_whole", shared_whole, {}},
      {"topology by name, shared", "shared_named", shared_named, {}},
      {"the same, positions built there", "shared_in_place", shared_in_place, {}},
      {"move, shared", "shared_moved", shared_moved, {}},
  };
  Table table({"", "ms a step", "s in all", "bytes up a node", "times as fast"});
  std::vector<std::string> header = {"ms of a step, medians"};
  for (const auto& [name, seconds] : kStages) header.emplace_back(name);
  Table stages(header);
  for (const Row& row : rows) {
    const Figures& f = row.figures;
    table.add({row.name, number(f.median_ms), number(f.total_seconds),
               row.bytes ? number(*row.bytes) : "",
               ratio(sent_whole.total_seconds / f.total_seconds)});
    std::vector<std::string> cells = {row.name};
    for (const double ms : f.stage_ms) cells.push_back(number(ms));
    stages.add(cells);
  }
  table.print(std::cout);
  stages.print(std::cout);
  Json json;
  json.set("node_count", mesh.node_count());
  json.set("step_count", settings.step_count);
  json.set("method", settings.optimize ? "optimize" : "laplacian");
  if (!settings.optimize) json.set("sweep_count", settings.sweep_count);
  for (const Row& row : rows) {
    json.set(std::string(row.key) + "_milliseconds", row.figures.median_ms);
  }
  json.set("whole_bytes_up_per_node", whole_bytes);
  json.set("named_bytes_up_per_node", named_bytes);
  write_json(settings.json, json);
}

}  // namespace

void add_steps_command(CLI::App& app, Action& action) {
  const auto settings = std::make_shared<Settings>();
  CLI::App* const sub = app.add_subcommand(
      "steps", "A moving mesh through the service, sent whole or by its topology's name");
  sub->add_option("--backend", settings->backend, "cpu, cuda or cuda:N")->capture_default_str();
  sub->add_option("--nodes", settings->node_count, "About so many nodes; a cube's number is taken")
      ->check(CLI::Range(27, 10'000'000))
      ->capture_default_str();
  sub->add_option("--steps", settings->step_count, "Of the loop")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  sub->add_option("--sweeps", settings->sweep_count, "Of each step")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  sub->add_flag("!--no-guard", settings->guard, "Plain averaging");
  sub->add_flag("--optimize", settings->optimize,
                "Jobs with the default options in place of sweeps of averaging");
  sub->add_flag("--full-quality-detail", settings->full_quality_detail,
                "All metrics before and after, in both");
  sub->add_option("--json", settings->json, "Write the figures to this file too");
  sub->callback([&action, settings] {
    action = [settings] {
      server::keep_heap_warm();
      run(*settings);
      return 0;
    };
  });
}

}  // namespace meshsmooth::bench

// What the first job of a method takes once the server says that it serves, beside later ones.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "gpu/commands.hpp"
#include "gpu/report.hpp"
#include "host_memory.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/method_traits.hpp"
#include "meshsmooth/server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::bench {
namespace {

struct Settings {
  std::string backend = "cpu";
  std::string method = "optimize";
  int node_count = 10'000;
  bool warm_up = true;
};

constexpr std::size_t kWarmJobs = 8;

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

Method find_method(const std::string& name) {
  std::optional<Method> found;
  for_each_method([&](const Method& method) {
    if (method_name(method) == name) found = method;
  });
  if (!found) throw InvalidOption("OPTION_OUT_OF_RANGE", "no method is named " + name, {});
  return *found;
}

void run(const Settings& settings) {
  const int cells = std::max(1, static_cast<int>(std::lround(std::cbrt(settings.node_count))) - 1);
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, cells), 0.15, 1);
  SmoothOptions options;
  options.method = find_method(settings.method);
  const std::vector<NodeId> boundary = find_boundary_nodes(MeshTopology(mesh).view());
  std::vector<Vec3d> there;
  for (const NodeId node : boundary) {
    Vec3d p = test::points(mesh)[static_cast<std::size_t>(node)];
    p.x += 0.3 * std::sin(p.z);
    there.push_back(p);
  }
  JobInput input;
  if (settings.method == "move") input.prescribed = {boundary, std::span<const Vec3d>(there)};

  const auto begin = std::chrono::steady_clock::now();
  server::Server server({.listen = "127.0.0.1:0",
                         .backend = settings.backend,
                         .warm_up = settings.warm_up,
                         .log_level = "off"});
  server.start();
  const double start_ms = milliseconds_since(begin);
  client::Client client("127.0.0.1:" + std::to_string(server.port()));
  if (!client.healthy()) throw std::runtime_error("the server does not serve");
  Table stages({"ms", "receive", "queue", "upload", "neighbours", "boundary", "iterate", "evaluate",
                "download", "send", "all"});
  const auto job = [&](const std::string& name) {
    Mesh copy = mesh;
    const auto sent = std::chrono::steady_clock::now();
    const client::SmoothReport report = client.smooth(copy, options, {}, input);
    const double all = milliseconds_since(sent);
    if (name.empty()) return all;
    const StageTimes& times = report.summary.times;
    std::vector<std::string> row = {name};
    for (const double seconds :
         {report.receive_seconds, report.queue_seconds, times.upload_seconds,
          times.find_neighbours_seconds, times.find_boundary_seconds, times.iterate_seconds,
          times.evaluate_seconds, times.download_seconds, report.send_seconds}) {
      row.push_back(number(1e3 * seconds));
    }
    row.push_back(number(all));
    stages.add(row);
    return all;
  };
  const double first = job("first");
  std::vector<double> warm = {job("second")};
  while (warm.size() < kWarmJobs) warm.push_back(job(""));
  warm.push_back(job("tenth"));
  std::cout << settings.method << ", " << mesh.node_count() << " nodes, " << settings.backend
            << ": serving after " << number(start_ms) << " ms, first job " << number(first)
            << " ms, later ones " << number(median(warm)) << " ms, ratio "
            << number(first / median(warm)) << "\n";
  stages.print(std::cout);
}

}  // namespace

void add_first_command(CLI::App& app, Action& action) {
  const auto settings = std::make_shared<Settings>();
  CLI::App* const sub =
      app.add_subcommand("first", "The first job after the server's start beside later ones");
  sub->add_option("--backend", settings->backend, "cpu, cuda or cuda:N")->capture_default_str();
  sub->add_option("--method", settings->method, "Of the jobs")->capture_default_str();
  sub->add_option("--nodes", settings->node_count, "About so many nodes; a cube's number is taken")
      ->check(CLI::Range(27, 10'000'000))
      ->capture_default_str();
  sub->add_flag("!--no-warm-up", settings->warm_up, "Serve at once");
  sub->callback([&action, settings] {
    action = [settings] {
      server::keep_heap_warm();
      run(*settings);
      return 0;
    };
  });
}

}  // namespace meshsmooth::bench

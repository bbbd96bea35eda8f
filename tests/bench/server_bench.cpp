// Jobs per second through the whole service, gRPC on loopback included.
// Server and clients share one process, each client with a connection of its own.

#include <grpcpp/create_channel.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <iostream>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "client_access.hpp"
#include "gpu/commands.hpp"
#include "gpu/report.hpp"
#include "host_memory.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

struct Settings {
  std::string backend = "auto";
  std::vector<int> lane_counts = {1, 8};
  int client_count = 16;
  int node_count = 5000;
  double tolerance = 1e-4;
  double seconds = 5;
  bool float64 = false;
  std::string json;
};

struct Figures {
  std::string backend;
  int lane_count = 0;
  std::size_t job_count = 0;
  double jobs_per_second = 0;  // median over windows
  double slowest_window = 0;
  double fastest_window = 0;
  double p50_ms = 0;  // of a job, as its client sees it
  double p99_ms = 0;
  double run_ms = 0;  // median, of the lane
};

// Rates are taken over windows, so that a hiccup is one of many values.
constexpr Seconds kWindow{0.25};
constexpr Seconds kWarmUp{1};

SmoothOptions plain_options(double tolerance) {
  SmoothOptions options;
  options.method = Laplacian{};
  options.form = Form::jacobi;
  options.tolerance = {tolerance, true};
  options.guard = false;
  return options;
}

/// A jittered cube of tetrahedra with about so many nodes.
Mesh make_mesh(const Settings& settings) {
  const int cells = std::max(1, static_cast<int>(std::lround(std::cbrt(settings.node_count))) - 1);
  Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, cells), 0.15, 1);
  return settings.float64 ? mesh : test::as_float32(mesh);
}

std::span<const std::byte> position_bytes(const Mesh& mesh) {
  return std::visit([](const auto& positions) { return std::as_bytes(std::span(positions)); },
                    mesh.positions);
}

double percentile(std::vector<double> values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

/// One client: sends the same mesh again and again.
class Caller {
 public:
  Caller(int port, const Mesh& mesh, const Mesh& expected, const SmoothOptions& options)
      : client_(connect(port)),
        start_(mesh),
        expected_(expected),
        options_(options),
        thread_([this] { run(); }) {}
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;
  ~Caller() { stop(); }

  [[nodiscard]] std::size_t job_count() const { return job_count_; }
  void start_measuring() { measuring_ = true; }
  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// After `stop`: throws what ended it early.
  void check() const {
    if (failure_) std::rethrow_exception(failure_);
  }
  [[nodiscard]] const std::vector<double>& milliseconds() const { return milliseconds_; }
  [[nodiscard]] const std::vector<double>& run_milliseconds() const { return run_milliseconds_; }

 private:
  // Channels to one address share a connection unless told otherwise.
  static client::Client connect(int port) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return client::ClientAccess::make(
        grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port),
                                  grpc::InsecureChannelCredentials(), arguments),
        "the benchmark's server");
  }

  void run() {
    try {
      Mesh mesh = start_;
      while (!stopping_) {
        mesh.positions = start_.positions;
        const auto begin = Clock::now();
        const client::SmoothReport report = client_.smooth(mesh, options_);
        const Seconds elapsed = Clock::now() - begin;
        const auto result = position_bytes(mesh), truth = position_bytes(expected_);
        if (std::memcmp(result.data(), truth.data(), truth.size()) != 0) {
          throw std::runtime_error("an answer differs from that of a smoother alone");
        }
        ++job_count_;
        if (!measuring_) continue;
        const StageTimes& times = report.summary.times;
        milliseconds_.push_back(1e3 * elapsed.count());
        run_milliseconds_.push_back(1e3 * (times.upload_seconds + times.find_neighbours_seconds +
                                           times.find_boundary_seconds + times.iterate_seconds +
                                           times.evaluate_seconds + times.download_seconds));
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  client::Client client_;
  const Mesh& start_;
  const Mesh& expected_;
  const SmoothOptions& options_;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> measuring_ = false;
  std::atomic<std::size_t> job_count_ = 0;
  std::vector<double> milliseconds_;
  std::vector<double> run_milliseconds_;
  std::exception_ptr failure_;
  std::thread thread_;
};

Figures measure(const Settings& settings, int lane_count, const Mesh& mesh) {
  const SmoothOptions options = plain_options(settings.tolerance);
  server::ServerConfig config;
  config.listen = "127.0.0.1:0";
  config.backend = settings.backend;
  config.lanes = lane_count;
  config.lame_duck = std::chrono::seconds(0);
  config.log_level = "off";
  server::Server server(config);
  server.start();

  Mesh expected = mesh;
  const std::unique_ptr<Smoother> alone = make_smoother(settings.backend);
  alone->smooth(expected, options);
  Figures figures{.backend = std::string(alone->backend()), .lane_count = lane_count};

  std::vector<std::unique_ptr<Caller>> callers;
  for (int c = 0; c < settings.client_count; ++c) {
    callers.push_back(std::make_unique<Caller>(server.port(), mesh, expected, options));
  }
  const auto count_jobs = [&] {
    std::size_t sum = 0;
    for (const auto& caller : callers) sum += caller->job_count();
    return sum;
  };
  std::this_thread::sleep_for(kWarmUp);
  for (const auto& caller : callers) caller->start_measuring();

  std::vector<double> rates;
  const auto begin = Clock::now();
  const std::size_t first = count_jobs();
  auto window_begin = begin;
  std::size_t before = first;
  while (window_begin - begin < Seconds(settings.seconds)) {
    std::this_thread::sleep_for(kWindow);
    const auto now = Clock::now();
    const std::size_t jobs = count_jobs();
    rates.push_back(static_cast<double>(jobs - before) / Seconds(now - window_begin).count());
    window_begin = now;
    before = jobs;
  }
  figures.job_count = before - first;

  std::vector<double> milliseconds, run_milliseconds;
  for (const auto& caller : callers) {
    caller->stop();
    caller->check();
    milliseconds.insert(milliseconds.end(), caller->milliseconds().begin(),
                        caller->milliseconds().end());
    run_milliseconds.insert(run_milliseconds.end(), caller->run_milliseconds().begin(),
                            caller->run_milliseconds().end());
  }
  if (milliseconds.empty()) throw std::runtime_error("no job ended in time; use more --seconds");
  figures.jobs_per_second = median(rates);
  figures.slowest_window = *std::ranges::min_element(rates);
  figures.fastest_window = *std::ranges::max_element(rates);
  figures.p50_ms = percentile(milliseconds, 0.5);
  figures.p99_ms = percentile(milliseconds, 0.99);
  figures.run_ms = percentile(run_milliseconds, 0.5);
  return figures;
}

std::size_t wire_bytes(const Mesh& mesh) {
  std::size_t bytes = 2 * position_bytes(mesh).size();  // there and back
  for (const ElementBlock& block : mesh.blocks) bytes += block.nodes.size() * sizeof(NodeId);
  return bytes;
}

void print(std::ostream& out, const Settings& settings, const Mesh& mesh,
           const std::vector<Figures>& all) {
  out << "Through gRPC on loopback: " << mesh.node_count() << " nodes, " << mesh.element_count()
      << " tetrahedra, " << (settings.float64 ? "float64" : "float32") << ", "
      << wire_bytes(mesh) / 1000 << " kB a job; " << settings.client_count
      << " clients; rates are medians over windows of " << kWindow.count() << " s\n";
  Table table({"backend", "lanes", "jobs/s", "slowest", "fastest", "MB/s", "job p50 ms",
               "job p99 ms", "lane ms", "of one lane"});
  for (const Figures& f : all) {
    table.add({f.backend, std::to_string(f.lane_count), number(f.jobs_per_second),
               number(f.slowest_window), number(f.fastest_window),
               number(f.jobs_per_second * static_cast<double>(wire_bytes(mesh)) * 1e-6),
               number(f.p50_ms), number(f.p99_ms), number(f.run_ms),
               ratio(f.jobs_per_second / all.front().jobs_per_second)});
  }
  table.print(out);
}

Json to_json(const Settings& settings, const Mesh& mesh, const std::vector<Figures>& all) {
  Json json;
  json.set("node_count", mesh.node_count());
  json.set("element_count", mesh.element_count());
  json.set("float64", settings.float64);
  json.set("wire_bytes", wire_bytes(mesh));
  json.set("client_count", settings.client_count);
  json.set("seconds", settings.seconds);
  Json lanes;
  for (const Figures& f : all) {
    Json one;
    one.set("backend", f.backend);
    one.set("lane_count", f.lane_count);
    one.set("job_count", f.job_count);
    one.set("jobs_per_second", f.jobs_per_second);
    one.set("slowest_window_jobs_per_second", f.slowest_window);
    one.set("fastest_window_jobs_per_second", f.fastest_window);
    one.set("job_p50_milliseconds", f.p50_ms);
    one.set("job_p99_milliseconds", f.p99_ms);
    one.set("lane_milliseconds", f.run_ms);
    lanes.push(std::move(one));
  }
  json.set("lanes", std::move(lanes));
  return json;
}

void run(const Settings& settings) {
  const Mesh mesh = make_mesh(settings);
  std::vector<Figures> all;
  for (const int lanes : settings.lane_counts) all.push_back(measure(settings, lanes, mesh));
  print(std::cout, settings, mesh, all);
  write_json(settings.json, to_json(settings, mesh, all));
}

}  // namespace

void add_server_command(CLI::App& app, Action& action) {
  // Shared by the options, which fill it, and the action, which runs later.
  const auto settings = std::make_shared<Settings>();
  CLI::App* const sub =
      app.add_subcommand("server", "Jobs per second through the service, gRPC on loopback");
  sub->add_option("--backend", settings->backend, "auto, cpu, cuda or cuda:N")
      ->capture_default_str();
  sub->add_option("--lanes", settings->lane_counts, "Numbers of lanes; the first is the reference")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  sub->add_option("--clients", settings->client_count, "Clients that call at the same time")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  sub->add_option("--nodes", settings->node_count, "About so many nodes; a cube's number is taken")
      ->check(CLI::Range(8, 10'000'000))
      ->capture_default_str();
  sub->add_option("--tolerance", settings->tolerance, "Relative to the cube's diagonal")
      ->capture_default_str();
  sub->add_option("--seconds", settings->seconds, "Of measuring, for each number of lanes")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str();
  sub->add_flag("--float64", settings->float64, "Positions in double");
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

// What the service costs beside the work itself: a mesh through gRPC, in shared memory, over one
// raw TCP connection and to a smoother in this process, turn by turn. The server is a process of
// its own.

#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "gpu/commands.hpp"
#include "gpu/report.hpp"
#include "host_memory.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"
#include "raw_tcp.hpp"
#include "shared_memory.hpp"
#include "socket_folder.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Settings {
  std::vector<double> megabytes = {1.4, 14, 200};
  int round_count = 15;
  bool smooths = false;
  std::string json;
  std::string serve;
};

/// Leaves every mesh as it is: what remains is the service's own.
class IdleSmoother final : public Smoother {
 public:
  [[nodiscard]] std::string_view backend() const override { return "cpu"; }
  [[nodiscard]] MemoryEstimate estimate(const MeshSize&, const SmoothOptions&) const override {
    return {};
  }
  using Smoother::smooth;
  SmoothSummary smooth(const TopologyView& topology, const JobPositions&, const SmoothOptions&,
                       const JobControl&) override {
    SmoothSummary summary;
    summary.backend = "cpu";
    summary.nodes.total = static_cast<std::int64_t>(topology.node_count);
    return summary;
  }
};

std::unique_ptr<Smoother> make(const Settings& settings) {
  if (settings.smooths) return make_smoother("cpu");
  return std::make_unique<IdleSmoother>();
}

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

/// The server and the raw receiver in a process of their own; needs to be made before any thread.
class Peer {
 public:
  explicit Peer(const Settings& settings) {
    std::array<int, 2> down{}, up{};
    if (pipe(down.data()) != 0 || pipe(up.data()) != 0) fail("no pipe");
    process_ = fork();
    if (process_ < 0) fail("cannot fork");
    if (process_ == 0) {
      close(up[0]);
      close(down[1]);
      run(settings, up[1], down[0]);
    }
    close(up[1]);
    close(down[0]);
    stop_ = down[1];
    const bool told = read(up[0], ports_.data(), sizeof ports_) == sizeof ports_;
    close(up[0]);
    if (!told || clock_getcpuclockid(process_, &cpu_) != 0) fail("the server did not start");
  }
  ~Peer() {
    close(stop_);
    waitpid(process_, nullptr, 0);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] int server_port() const { return ports_[0]; }
  [[nodiscard]] int raw_port() const { return ports_[1]; }
  [[nodiscard]] std::string unix_address() const { return folder_.address(); }
  /// Of all its threads.
  [[nodiscard]] double cpu_seconds() const {
    timespec time{};
    clock_gettime(cpu_, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

 private:
  [[noreturn]] void run(const Settings& settings, int tell, int stop) const {
    int code = 1;
    try {
      server::ServerConfig config{.listen = "127.0.0.1:0",
                                  .lanes = 1,
                                  .lame_duck = std::chrono::seconds(0),
                                  .log_level = "off"};
      server::Server server(config, [&] { return make(settings); });
      server.start();
      config.listen = unix_address();
      server::Server local(config, [&] { return make(settings); });
      local.start();
      const RawListener listener = listen_raw();
      std::thread(serve_raw, listener.socket).detach();
      const std::array ports = {server.port(), listener.port};
      char end = 0;
      if (write(tell, ports.data(), sizeof ports) == sizeof ports && read(stop, &end, 1) == 0) {
        code = 0;
      }
      local.drain();  // removes its sockets
    } catch (const std::exception& error) {
      std::cerr << "the server's process: " << error.what() << std::endl;
    }
    _exit(code);
  }

  const server::SocketFolder folder_{"listen"};
  pid_t process_;
  int stop_ = -1;
  clockid_t cpu_{};
  std::array<int, 2> ports_{};
};

/// What was measured of one size, in seconds.
struct Times {
  std::vector<double> raw_up{}, raw_down{};
  std::vector<double> call{}, call_up{}, call_down{};   // through the service
  std::vector<double> unix_call{}, copied{}, inside{};  // on the host: see SharedMemory
  std::vector<double> alone{};                          // in this process
  double server_cpu = 0;
};
struct Samples {
  Mesh mesh;
  std::size_t up_bytes = 0, down_bytes = 0;
  Times times{};
};

/// A jittered cube of tetrahedra, of all such the one of most nearly so many bytes.
Mesh make_mesh(double megabytes) {
  const auto excess = [=](int cells) {
    const double nodes = std::pow(cells + 1, 3), tetrahedra = 6 * std::pow(cells, 3);
    return nodes * sizeof(Vec3d) + tetrahedra * 4 * sizeof(NodeId) - megabytes * 1e6;
  };
  int cells = 1;
  while (excess(cells + 1) < 0) ++cells;
  if (excess(cells + 1) < -excess(cells)) ++cells;
  return test::noisy(test::lattice(ElementType::tetrahedron, cells), 0.15, 1);
}

SmoothOptions one_sweep() {
  SmoothOptions options;
  options.method = Laplacian{};
  options.guard = false;
  options.max_iterations = 1;
  options.quality_detail = QualityDetail::brief;
  return options;
}

double seconds_of(const auto& body) {
  const auto begin = Clock::now();
  body();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void measure_raw(Samples& samples, RawClient& raw) {
  const RawClient::Seconds seconds = raw.move(samples.up_bytes, samples.down_bytes);
  samples.times.raw_up.push_back(seconds.up);
  samples.times.raw_down.push_back(seconds.down);
}

void measure_alone(Samples& samples, Smoother& smoother, const SmoothOptions& options) {
  samples.times.alone.push_back(seconds_of([&] { smoother.smooth(samples.mesh, options); }));
}

void measure_call(Samples& samples, client::Client& client, const Peer& peer,
                  const SmoothOptions& options) {
  const double cpu_before = peer.cpu_seconds();
  client::SmoothReport report;
  const double call = seconds_of([&] { report = client.smooth(samples.mesh, options); });
  samples.times.server_cpu += peer.cpu_seconds() - cpu_before;
  samples.times.call.push_back(call);
  // Each of the two has what is neither: spec, acceptance, summary and status.
  samples.times.call_up.push_back(call - report.send_seconds);
  samples.times.call_down.push_back(call - report.receive_seconds);
}

void measure_shared(Samples& samples, SharedMemory& shared, const SmoothOptions& options) {
  const SharedMemory::Seconds seconds = shared.measure(samples.mesh, options);
  samples.times.unix_call.push_back(seconds.chunks);
  samples.times.copied.push_back(seconds.copied);
  samples.times.inside.push_back(seconds.inside);
}

struct Figures {
  double megabytes, raw_up, raw_down, up, down;  // GB/s
  double call_ms, alone_ms, raw_ms;              // medians
  double unix_ms, copied_ms, inside_ms;          // the same on the host
  double cpu_seconds_per_gib;                    // of the server

  [[nodiscard]] double cost_ms() const { return call_ms - alone_ms; }
};

Figures figures_of(const Samples& samples) {
  const auto up = static_cast<double>(samples.up_bytes);
  const auto down = static_cast<double>(samples.down_bytes);
  const double gib =
      (up + down) * static_cast<double>(samples.times.call.size()) / static_cast<double>(1 << 30);
  return {.megabytes = up * 1e-6,
          .raw_up = up * 1e-9 / median(samples.times.raw_up),
          .raw_down = down * 1e-9 / median(samples.times.raw_down),
          .up = up * 1e-9 / median(samples.times.call_up),
          .down = down * 1e-9 / median(samples.times.call_down),
          .call_ms = 1e3 * median(samples.times.call),
          .alone_ms = 1e3 * median(samples.times.alone),
          .raw_ms = 1e3 * (median(samples.times.raw_up) + median(samples.times.raw_down)),
          .unix_ms = 1e3 * median(samples.times.unix_call),
          .copied_ms = 1e3 * median(samples.times.copied),
          .inside_ms = 1e3 * median(samples.times.inside),
          .cpu_seconds_per_gib = samples.times.server_cpu / gib};
}

void print(std::ostream& out, const Settings& settings, const std::vector<Figures>& all) {
  out << "A mesh there and its positions back, " << settings.round_count
      << " rounds of raw TCP, the smoother alone and the service; medians. The smoother "
      << (settings.smooths ? "makes one sweep" : "does nothing") << ".\n";
  Table table({"MB up", "TCP up GB/s", "down", "service up GB/s", "down", "of TCP up", "down",
               "TCP ms", "service ms", "alone ms", "costs ms", "server CPU s/GiB"});
  for (const Figures& f : all) {
    table.add({number(f.megabytes), number(f.raw_up), number(f.raw_down), number(f.up),
               number(f.down), number(f.up / f.raw_up), number(f.down / f.raw_down),
               number(f.raw_ms), number(f.call_ms), number(f.alone_ms), number(f.cost_ms()),
               number(f.cpu_seconds_per_gib)});
  }
  table.print(out);
  out << "On the same host: chunks over a Unix socket, and in shared memory, copied there and back "
         "or built in it; as shares of chunks over TCP.\n";
  Table shared(
      {"MB up", "TCP ms", "Unix ms", "of TCP", "copied ms", "of TCP", "inside ms", "of TCP"});
  for (const Figures& f : all) {
    shared.add({number(f.megabytes), number(f.call_ms), number(f.unix_ms),
                number(f.unix_ms / f.call_ms), number(f.copied_ms), number(f.copied_ms / f.call_ms),
                number(f.inside_ms), number(f.inside_ms / f.call_ms)});
  }
  shared.print(out);
}

Json to_json(const Settings& settings, const std::vector<Figures>& all) {
  Json json;
  json.set("round_count", settings.round_count);
  json.set("smooths", settings.smooths);
  Json sizes;
  for (const Figures& f : all) {
    Json one;
    one.set("megabytes_up", f.megabytes);
    one.set("raw_up_gigabytes_per_second", f.raw_up);
    one.set("raw_down_gigabytes_per_second", f.raw_down);
    one.set("service_up_gigabytes_per_second", f.up);
    one.set("service_down_gigabytes_per_second", f.down);
    one.set("raw_milliseconds", f.raw_ms);
    one.set("service_milliseconds", f.call_ms);
    one.set("unix_milliseconds", f.unix_ms);
    one.set("shared_copied_milliseconds", f.copied_ms);
    one.set("shared_inside_milliseconds", f.inside_ms);
    one.set("alone_milliseconds", f.alone_ms);
    one.set("cost_milliseconds", f.cost_ms());
    one.set("server_cpu_seconds_per_gibibyte", f.cpu_seconds_per_gib);
    sizes.push(std::move(one));
  }
  json.set("sizes", std::move(sizes));
  return json;
}

/// A server for clients in other languages, until standard input ends.
void serve(const std::string& listen) {
  server::Server server(
      {.listen = listen, .lanes = 1, .lame_duck = std::chrono::seconds(0), .log_level = "off"},
      [] { return std::make_unique<IdleSmoother>(); });
  server.start();
  std::cout << server.port() << std::endl;
  std::cin.get();
  server.drain();
}

void run(const Settings& settings) {
  const Peer peer(settings);
  RawClient raw(peer.raw_port());
  client::Client client("127.0.0.1:" + std::to_string(peer.server_port()));
  SharedMemory shared(peer.unix_address());
  const std::unique_ptr<Smoother> alone = make(settings);
  const SmoothOptions options = one_sweep();
  std::vector<Samples> sizes;
  for (const double megabytes : settings.megabytes) {
    Samples samples;
    samples.mesh = make_mesh(megabytes);
    for (const ElementBlock& block : samples.mesh.blocks) {
      samples.up_bytes += block.nodes.size() * sizeof(NodeId);
    }
    samples.down_bytes = samples.mesh.node_count() * sizeof(Vec3d);
    samples.up_bytes += samples.down_bytes;
    sizes.push_back(std::move(samples));
  }
  for (Samples& samples : sizes) shared.warm_up(samples.mesh, options);
  for (int round = -1; round < settings.round_count; ++round) {
    for (Samples& samples : sizes) {
      // Small ones more often: about as long in all.
      const int repeats =
          static_cast<int>(std::clamp<std::size_t>(14'000'000 / samples.up_bytes, 1, 10));
      for (int i = 0; i < repeats; ++i) {
        measure_raw(samples, raw);
        measure_alone(samples, *alone, options);
        measure_call(samples, client, peer, options);
        measure_shared(samples, shared, options);
      }
      if (round < 0) samples.times = {};  // that was to warm up
    }
  }
  std::vector<Figures> all;
  for (const Samples& samples : sizes) all.push_back(figures_of(samples));
  print(std::cout, settings, all);
  write_json(settings.json, to_json(settings, all));
}

}  // namespace

void add_transport_command(CLI::App& app, Action& action) {
  const auto settings = std::make_shared<Settings>();
  CLI::App* const sub = app.add_subcommand(
      "transport", "What the service adds to the work: beside raw TCP and a smoother in-process");
  sub->add_option("--megabytes", settings->megabytes, "Sizes of the meshes, about")
      ->delimiter(',')
      ->check(CLI::Range(0.01, 4000.0))
      ->capture_default_str();
  sub->add_option("--rounds", settings->round_count, "Of all that is compared")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  sub->add_flag("--smooth", settings->smooths, "One real sweep, instead of none at all");
  sub->add_option("--json", settings->json, "Write the figures to this file too");
  sub->add_option("--serve", settings->serve,
                  "Only serve on this address, with a smoother that does nothing, until standard "
                  "input ends; prints the port");
  sub->callback([&action, settings] {
    action = [settings] {
      server::keep_heap_warm();
      if (!settings->serve.empty()) {
        serve(settings->serve);
        return 0;
      }
      run(*settings);
      return 0;
    };
  });
}

}  // namespace meshsmooth::bench

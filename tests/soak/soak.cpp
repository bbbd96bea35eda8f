// Mixed jobs for a long time, from many callers: every answer is checked, and the server's memory
// must not grow. Exit codes: 0 so it is, 1 an answer was wrong, 3 the memory grew.
//
// MESHSMOOTH_SOAK_LEAK_BYTES plants a leak, of so many bytes a job, in the smoother that this
// program gives its server: to see that it would be noticed.

#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <barrier>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "host_memory.hpp"
#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"
#include "support/http.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::soak {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;
using client::ServiceError;
using client::StatusCode;

constexpr std::int64_t kMiB = 1 << 20;
constexpr std::int64_t kMaxGrowthBytes = 20 * kMiB;

struct Settings {
  double seconds = 1800;
  int caller_count = 4;
  int jobs_a_round = 6;  // of each caller; then all wait for the server to be idle
};

/// The real one; where a leak is planted it keeps memory for every job.
class SoakedSmoother final : public Smoother {
 public:
  explicit SoakedSmoother(std::size_t leak_bytes)
      : real_(make_smoother("cpu", 1)), leak_bytes_(leak_bytes) {}

  [[nodiscard]] std::string_view backend() const override { return real_->backend(); }
  [[nodiscard]] MemoryEstimate estimate(const MeshSize& size,
                                        const SmoothOptions& options) const override {
    return real_->estimate(size, options);
  }
  [[nodiscard]] std::shared_ptr<const PreparedTopology> prepare(
      const TopologyView& topology, const JobControl& control,
      const PositionsView& reference) override {
    return real_->prepare(topology, control, reference);
  }
  [[nodiscard]] MemoryEstimate estimate_prepared(const MeshSize& size) const override {
    return real_->estimate_prepared(size);
  }
  SmoothSummary smooth(const TopologyView& topology, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    leak();
    return real_->smooth(topology, positions, options, control);
  }
  SmoothSummary smooth(const PreparedTopology& prepared, const JobPositions& positions,
                       const SmoothOptions& options, const JobControl& control) override {
    leak();
    return real_->smooth(prepared, positions, options, control);
  }

 private:
  void leak() {
    if (leak_bytes_ > 0) leaked_.emplace_back(leak_bytes_, 'x');
  }

  const std::unique_ptr<Smoother> real_;
  const std::size_t leak_bytes_;
  std::vector<std::string> leaked_;
};

/// The server in a process of its own; needs to be made before any thread.
class Peer {
 public:
  Peer() {
    std::array<int, 2> down{}, up{};
    if (pipe(down.data()) != 0 || pipe(up.data()) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ < 0) throw std::runtime_error("cannot fork");
    if (process_ == 0) {
      close(up[0]);
      close(down[1]);
      run(up[1], down[0]);
    }
    close(up[1]);
    close(down[0]);
    stop_ = down[1];
    const bool told = read(up[0], ports_.data(), sizeof ports_) == sizeof ports_;
    close(up[0]);
    if (!told) throw std::runtime_error("the server did not start");
  }
  ~Peer() {
    close(stop_);
    waitpid(process_, nullptr, 0);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] std::string target() const { return "127.0.0.1:" + std::to_string(ports_[0]); }

  /// Once nothing is under way.
  [[nodiscard]] std::int64_t idle_resident_bytes() const {
    const auto give_up = Clock::now() + 60s;
    for (;;) {
      const auto metrics = testing::parse_metrics(testing::http_get(ports_[1], "/metrics").text);
      double under_way = metrics.at("meshsmooth_streams");
      for (const char* state : {"receiving", "queued", "running", "sending"}) {
        under_way += metrics.at(std::string("meshsmooth_jobs{state=\"") + state + "\"}");
      }
      if (under_way == 0) return resident_bytes();
      if (Clock::now() > give_up) throw std::runtime_error("the server does not become idle");
      std::this_thread::sleep_for(2ms);
    }
  }

 private:
  [[nodiscard]] std::int64_t resident_bytes() const {
    std::ifstream status("/proc/" + std::to_string(process_) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmRSS:")) return 1024 * std::stoll(line.substr(6));
    }
    throw std::runtime_error("the server's process is gone");
  }

  [[noreturn]] static void run(int tell, int stop) {
    int code = 1;
    try {
      const char* const leak = std::getenv("MESHSMOOTH_SOAK_LEAK_BYTES");
      const std::size_t leak_bytes = leak == nullptr ? 0 : std::stoull(leak);
      // Bounds low enough to be reached soon: what may be kept is no leak.
      server::Server server({.listen = "127.0.0.1:0",
                             .admin_listen = "127.0.0.1:0",
                             .backend = "cpu",
                             .lanes = 2,
                             .host_memory_limit_bytes = 512 * kMiB,
                             .idle_pinned_bytes = 16 * kMiB,
                             .max_kept_jobs = 100,
                             .max_kept_result_bytes = 8 * kMiB,
                             .max_topology_bytes = 16 * kMiB,
                             .lame_duck = std::chrono::seconds(0),
                             .log_level = "off"},
                            [=] { return std::make_unique<SoakedSmoother>(leak_bytes); });
      server.start();
      const std::array ports = {server.port(), server.admin_port()};
      char end = 0;
      if (write(tell, ports.data(), sizeof ports) == sizeof ports && read(stop, &end, 1) == 0) {
        code = 0;
      }
    } catch (const std::exception& error) {
      std::cerr << "the server's process: " << error.what() << std::endl;
    }
    _exit(code);
  }

  pid_t process_;
  int stop_ = -1;
  std::array<int, 2> ports_{};
};

std::vector<Mesh> make_meshes() {
  std::vector<Mesh> meshes;
  for (const int cells : {2, 6, 12, 20}) {
    meshes.push_back(test::noisy(test::lattice(ElementType::tetrahedron, cells), 0.15, 1));
  }
  meshes.push_back(test::as_float32(meshes.back()));
  meshes.push_back(test::noisy(test::lattice(ElementType::triangle, 60), 0.15, 2));
  meshes.push_back(test::noisy(test::lattice(ElementType::hexahedron, 12), 0.15, 3));
  return meshes;
}

std::vector<SmoothOptions> make_options() {
  std::vector<SmoothOptions> all;
  for (const Method& method : {Method(Laplacian{}), Method(SmartLaplacian{}), Method(Taubin{}),
                               Method(HcLaplacian{}), Method(Optimize{})}) {
    SmoothOptions options;
    options.method = method;
    options.max_iterations = 4;
    all.push_back(options);
  }
  return all;
}

/// What all callers know, and what happened to them. Thread-safe.
class Record {
 public:
  void count(const std::string& outcome) {
    const std::lock_guard lock(mutex_);
    ++counts_[outcome];
  }
  void wrong(const std::string& what) {
    const std::lock_guard lock(mutex_);
    ++wrong_count_;
    if (wrong_count_ <= 20) std::cerr << "wrong: " << what << std::endl;
  }
  /// The same request has the same bits, whenever and by whomever.
  void check_bits(const std::string& request, const Mesh& mesh) {
    const std::lock_guard lock(mutex_);
    const auto [known, is_new] = results_.emplace(request, mesh.positions);
    if (is_new || known->second == mesh.positions) return;
    ++wrong_count_;
    std::cerr << "wrong: " << request << " has other bits than before" << std::endl;
  }

  [[nodiscard]] std::map<std::string, std::int64_t> counts() const { return counts_; }
  [[nodiscard]] std::int64_t wrong_count() const { return wrong_count_; }

 private:
  std::mutex mutex_;
  std::map<std::string, std::int64_t> counts_;
  std::map<std::string, decltype(Mesh::positions)> results_;
  std::int64_t wrong_count_ = 0;
};

/// One caller's jobs, drawn by lot.
class Caller {
 public:
  Caller(const Peer& peer, const std::vector<Mesh>& meshes,
         const std::vector<SmoothOptions>& options, Record& record, unsigned seed)
      : client_(peer.target()),
        meshes_(meshes),
        options_(options),
        record_(record),
        random_(seed) {}

  void run_one() {
    switch (draw(10)) {
      case 0:
        return cancelled();
      case 1:
        return late();
      case 2:
        return wrong_mesh();
      case 3:
        return wrong_options();
      case 4:
      case 5:
        return named_topology();
      case 6:
        return kept_result();
      default:
        return plain();
    }
  }

 private:
  std::size_t draw(std::size_t count) { return random_() % count; }

  /// A request that may fail in these ways; true when it succeeded.
  template <class Body>
  bool attempt(const std::string& what, std::initializer_list<StatusCode> allowed,
               const Body& body) {
    try {
      body();
      record_.count(what + ": ok");
      return true;
    } catch (const ServiceError& error) {
      if (std::ranges::count(allowed, error.code()) == 0) {
        record_.wrong(what + ": " + error.reason() + ": " + error.what());
      }
      record_.count(what + ": " + (error.reason().empty() ? "status only" : error.reason()));
      return false;
    }
  }

  /// What a mesh and options are called.
  struct Pick {
    const Mesh& mesh;
    const SmoothOptions& options;
    std::string name;
  };
  Pick pick() {
    const std::size_t m = draw(meshes_.size()), o = draw(options_.size());
    return {meshes_[m], options_[o], "mesh " + std::to_string(m) + " options " + std::to_string(o)};
  }

  void plain() {
    const Pick job = pick();
    Mesh mesh = job.mesh;
    if (attempt("plain", {StatusCode::resource_exhausted},
                [&] { client_.smooth(mesh, job.options); })) {
      record_.check_bits(job.name, mesh);
    }
  }

  void cancelled() {
    const Pick job = pick();
    Mesh mesh = job.mesh;
    std::stop_source stop;
    client::RequestOptions request;
    request.stop = stop.get_token();
    std::jthread stopper([&, wait = std::chrono::microseconds(draw(30'000))] {
      std::this_thread::sleep_for(wait);
      stop.request_stop();
    });
    attempt("cancelled", {StatusCode::cancelled, StatusCode::resource_exhausted},
            [&] { client_.smooth(mesh, job.options, request); });
  }

  void late() {
    const Pick job = pick();
    Mesh mesh = job.mesh;
    client::RequestOptions request;
    request.timeout = std::chrono::microseconds(200 + draw(30'000));
    attempt("late", {StatusCode::deadline_exceeded, StatusCode::resource_exhausted},
            [&] { client_.smooth(mesh, job.options, request); });
  }

  void wrong_mesh() {
    const Pick job = pick();
    Mesh mesh = job.mesh;
    mesh.blocks[0].nodes[draw(mesh.blocks[0].nodes.size())] = -1;
    if (attempt("wrong mesh", {StatusCode::invalid_argument, StatusCode::resource_exhausted},
                [&] { client_.smooth(mesh, job.options); })) {
      record_.wrong("a mesh with node -1 was smoothed");
    }
  }

  void wrong_options() {
    const Pick job = pick();
    Mesh mesh = job.mesh;
    SmoothOptions options = job.options;
    options.max_iterations = -1;
    if (attempt("wrong options", {StatusCode::invalid_argument},
                [&] { client_.smooth(mesh, options); })) {
      record_.wrong("-1 iterations were made");
    }
  }

  void named_topology() {
    const Pick job = pick();
    client::Session session = client_.open(job.mesh);
    for (int step = 0; step < 3; ++step) {
      Mesh mesh = job.mesh;
      const bool done = attempt("named", {StatusCode::resource_exhausted}, [&] {
        std::visit([&](auto& positions) { session.smooth(std::span(positions), job.options); },
                   mesh.positions);
      });
      if (done) record_.check_bits(job.name + " by name", mesh);
    }
  }

  void kept_result() {
    const Pick job = pick();
    Mesh mesh = job.mesh, again = job.mesh;
    client::RequestOptions request;
    request.result_ttl = 2s;
    client::SmoothReport report;
    if (!attempt("kept", {StatusCode::resource_exhausted},
                 [&] { report = client_.smooth(mesh, job.options, request); })) {
      return;
    }
    record_.check_bits(job.name, mesh);
    // Others' results may have pushed it out.
    if (attempt("attached", {StatusCode::not_found, StatusCode::resource_exhausted},
                [&] { client_.attach(report.job_name, again); })) {
      record_.check_bits(job.name, again);
    }
    if (draw(2) == 0) {
      attempt("deleted", {StatusCode::not_found}, [&] { client_.delete_job(report.job_name); });
    }
  }

  client::Client client_;
  const std::vector<Mesh>& meshes_;
  const std::vector<SmoothOptions>& options_;
  Record& record_;
  std::mt19937 random_;
};

std::int64_t median_of(const std::vector<std::int64_t>& samples, double from, double to) {
  const auto size = static_cast<double>(samples.size());
  const auto begin = static_cast<std::ptrdiff_t>(from * size);
  const auto end = std::max(static_cast<std::ptrdiff_t>(to * size), begin + 1);
  std::vector<std::int64_t> part(samples.begin() + begin, samples.begin() + end);
  std::ranges::nth_element(part, part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2));
  return part[part.size() / 2];
}

int run(const Settings& settings) {
  const Peer peer;
  const std::vector<Mesh> meshes = make_meshes();
  const std::vector<SmoothOptions> options = make_options();
  Record record;
  std::vector<std::int64_t> resident;  // after each round
  std::atomic<bool> over = false;
  const auto end = Clock::now() + std::chrono::duration<double>(settings.seconds);
  std::exception_ptr failure;
  // By the last caller to come, while the others wait.
  const auto between_rounds = [&]() noexcept {
    try {
      resident.push_back(peer.idle_resident_bytes());
      over = Clock::now() >= end && resident.size() >= 10;
    } catch (...) {
      failure = std::current_exception();
      over = true;
    }
  };
  std::barrier round(settings.caller_count, between_rounds);
  {
    std::vector<std::jthread> callers;
    for (int c = 0; c < settings.caller_count; ++c) {
      callers.emplace_back([&, c] {
        Caller caller(peer, meshes, options, record, static_cast<unsigned>(c));
        while (!over) {
          for (int j = 0; j < settings.jobs_a_round; ++j) caller.run_one();
          round.arrive_and_wait();
        }
      });
    }
  }
  if (failure) std::rethrow_exception(failure);

  std::int64_t total = 0;
  for (const auto& [outcome, count] : record.counts()) {
    std::cout << count << "\t" << outcome << "\n";
    total += count;
  }
  const std::int64_t middle = median_of(resident, 0.5, 0.6), last = median_of(resident, 0.9, 1);
  const std::int64_t growth = last - middle;
  std::cout << total << " requests in " << resident.size() << " rounds, " << record.wrong_count()
            << " wrong answers; resident memory after the first round " << resident.front() / kMiB
            << " MiB, in the middle " << middle / kMiB << ", at the end " << last / kMiB << "\n";
  if (growth > kMaxGrowthBytes) {
    std::cout << "LEAK: memory grew by " << growth / kMiB << " MiB in the second half, at most "
              << kMaxGrowthBytes / kMiB << " are allowed" << std::endl;
  }
  if (record.wrong_count() > 0) return 1;
  return growth > kMaxGrowthBytes ? 3 : 0;
}

}  // namespace
}  // namespace meshsmooth::soak

int main(int argc, char** argv) {
  CLI::App app("Mixed jobs for a long time: answers stay right, memory stays flat.", "soak");
  meshsmooth::soak::Settings settings;
  app.add_option("--seconds", settings.seconds, "At least ten rounds are made")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--callers", settings.caller_count, "That send jobs at the same time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    meshsmooth::server::keep_heap_warm();
    return meshsmooth::soak::run(settings);
  } catch (const std::exception& error) {
    std::cerr << "soak: " << error.what() << std::endl;
    return 1;
  }
}

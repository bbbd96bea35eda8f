#include <fmt/format.h>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "commands.hpp"
#include "connection.hpp"
#include "generate.hpp"
#include "interrupt.hpp"
#include "load.hpp"
#include "readable.hpp"
#include "smooth_options.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

struct BenchCommand {
  ServerAddress server;
  SmoothFlags smoothing;
  std::vector<std::string> sizes = {"5000"};
  int client_count = 4;
  std::optional<double> rate;  // an open loop
  int max_in_flight = 256;     // of an open loop
  double window_seconds = 1;
  double max_seconds = 60;
  std::int64_t max_jobs = 1'000'000;
  bool single = false;
  std::uint64_t seed = 1;
  std::optional<std::string> json;
};

struct LoadMesh {
  Mesh mesh;
  std::int64_t bytes_up = 0, bytes_down = 0;
};

LoadMesh make_load_mesh(const LoadSize& size, bool single) {
  LoadMesh made{formats::generate_pipe(size.node_count, 1), 0, 0};
  if (single) {
    std::vector<Vec3f> positions;
    for (const Vec3d& p : std::get<std::vector<Vec3d>>(made.mesh.positions)) {
      positions.push_back(vec3_cast<float>(p));
    }
    made.mesh.positions = std::move(positions);
  }
  const std::size_t place_bytes = single ? sizeof(Vec3f) : sizeof(Vec3d);
  made.bytes_down = static_cast<std::int64_t>(made.mesh.node_count() * place_bytes);
  made.bytes_up = made.bytes_down;
  for (const ElementBlock& block : made.mesh.blocks) {
    made.bytes_up += static_cast<std::int64_t>(block.nodes.size() * sizeof(NodeId));
  }
  return made;
}

/// The load while it runs. Jobs are drawn by lot from the sizes; each caller has a connection of
/// its own. Nothing is tried twice: a refusal is counted as one.
class Load {
 public:
  Load(const BenchCommand& command, const SmoothOptions& options, std::stop_token interrupt)
      : command_(command), options_(options), interrupt_(std::move(interrupt)) {
    std::vector<double> weights;
    for (const std::string& text : command.sizes) {
      const LoadSize size = parse_load_size(text);
      meshes_.push_back(make_load_mesh(size, command.single));
      weights.push_back(size.weight);
    }
    draw_ = std::discrete_distribution<std::size_t>(weights.begin(), weights.end());
    random_.seed(command.seed);
  }

  /// Until it is steady, or has lasted or sent as much as it may, or is interrupted.
  void run() {
    begin_ = Clock::now();
    if (command_.rate) {
      run_open();
    } else {
      run_closed();
    }
    measure_until_done();
    stop_.request_stop();
    callers_.clear();                        // joins; from now on nothing comes due
    { const std::lock_guard lock(mutex_); }  // whoever has not seen the stop waits by now
    due_changed_.notify_all();
    open_.clear();
  }

  [[nodiscard]] bool steady() const { return steady_; }
  [[nodiscard]] std::int64_t unsent_count() const { return unsent_; }
  [[nodiscard]] std::int64_t unfinished_count() const { return unfinished_; }
  [[nodiscard]] std::size_t window_count() const { return windows_.size(); }
  [[nodiscard]] std::vector<LoadMesh>& meshes() { return meshes_; }
  /// Of the last three windows when they were steady, else of all but the first, in which
  /// connections are made.
  [[nodiscard]] LoadFigures figures() const {
    const double end = std::max(measured_, 1e-9);
    const double window = command_.window_seconds;
    const double from = steady_ ? end - 3 * window : windows_.size() > 1 ? window : 0;
    return figures_of(record_.samples(), from, end);
  }

 private:
  struct Due {
    Clock::time_point time;
    std::size_t mesh;
  };

  std::size_t draw() {
    const std::lock_guard lock(mutex_);
    return draw_(random_);
  }
  bool may_send() { return sent_++ < command_.max_jobs; }

  void run_closed() {
    for (int c = 0; c < command_.client_count; ++c) {
      callers_.emplace_back([this] {
        client::Client client = command_.server.connect();
        while (!stop_.stop_requested() && may_send()) send(client, {Clock::now(), draw()});
        ++idle_callers_;
      });
    }
  }

  /// Arrivals by chance, so many a second; a caller for each that is under way.
  void run_open() {
    callers_.emplace_back([this] {
      std::exponential_distribution<double> gap(*command_.rate);
      std::mt19937_64 random(command_.seed + 1);
      auto due = begin_;
      while (!stop_.stop_requested() && may_send()) {
        due += std::chrono::duration_cast<Clock::duration>(Seconds(gap(random)));
        sleep_until(std::min(due, begin_ + to_duration(command_.max_seconds)), stop_.get_token());
        if (Clock::now() < due) break;  // stopped, or its time would come after the end
        arrive({due, draw()});
      }
      ++idle_callers_;
    });
  }

  /// Or until a stop is requested.
  static void sleep_until(Clock::time_point time, const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any stopped;
    std::unique_lock lock(mutex);
    stopped.wait_until(lock, stop, time, [] { return false; });
  }

  void arrive(const Due& due) {
    std::unique_lock lock(mutex_);
    if (waiting_callers_ == 0 || due_.size() >= static_cast<std::size_t>(waiting_callers_)) {
      if (open_callers_ >= command_.max_in_flight) {
        ++unsent_;
        return;
      }
      ++open_callers_;
      due_.push_back(due);
      lock.unlock();
      open_.emplace_back([this] { serve_arrivals(); });
      return;
    }
    due_.push_back(due);
    lock.unlock();
    due_changed_.notify_one();
  }

  void serve_arrivals() {
    client::Client client = command_.server.connect();
    std::unique_lock lock(mutex_);
    for (;;) {
      ++waiting_callers_;
      due_changed_.wait(lock, [this] { return !due_.empty() || stop_.stop_requested(); });
      --waiting_callers_;
      if (due_.empty()) return;
      const Due due = due_.front();
      due_.pop_front();
      lock.unlock();
      send(client, due);
      lock.lock();
      if (stop_.stop_requested()) return;
    }
  }

  void send(client::Client& client, const Due& due) {
    const LoadMesh& load = meshes_[due.mesh];
    Mesh mesh = load.mesh;
    client::RequestOptions request;
    request.max_attempts = 1;
    request.stop = stop_.get_token();
    LoadSample sample;
    try {
      client.smooth(mesh, options_, request);
      sample.bytes_up = load.bytes_up;
      sample.bytes_down = load.bytes_down;
    } catch (const client::ServiceError& error) {
      if (stop_.stop_requested()) {
        ++unfinished_;
        return;
      }
      const bool refused =
          error.code() == client::StatusCode::resource_exhausted ||
          (error.code() == client::StatusCode::unavailable && error.reason() == "DRAINING");
      sample.outcome = refused ? Outcome::refused : Outcome::failed;
      sample.reason = error.reason().empty() ? error.what() : error.reason();
    } catch (const std::exception& error) {
      sample.outcome = Outcome::failed;
      sample.reason = error.what();
    }
    const auto now = Clock::now();
    sample.end = Seconds(now - begin_).count();
    sample.latency = Seconds(now - due.time).count();
    record_.add(std::move(sample));
  }

  void measure_until_done() {
    const auto window = to_duration(command_.window_seconds);
    const auto limit = begin_ + to_duration(command_.max_seconds);
    for (auto end = begin_ + window; !steady_; end += window) {
      // In steps, to see that there is nothing more to send.
      constexpr auto kStep = std::chrono::milliseconds(20);
      while (Clock::now() < std::min(end, limit) && !done() && !interrupt_.stop_requested()) {
        sleep_until(Clock::now() + kStep, interrupt_);
      }
      measured_ = Seconds(Clock::now() - begin_).count();
      if (Clock::now() < end || interrupt_.stop_requested() || done()) return;
      measured_ = Seconds(end - begin_).count();
      windows_.push_back(
          figures_of(record_.samples(), measured_ - command_.window_seconds, measured_));
      steady_ = is_steady(windows_);
      if (Clock::now() >= limit) return;
    }
  }

  /// All that may be sent was, and has ended.
  bool done() {
    const std::lock_guard lock(mutex_);
    return idle_callers_ == static_cast<int>(callers_.size()) && due_.empty() &&
           waiting_callers_ == open_callers_;
  }

  static Clock::duration to_duration(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
  }

  const BenchCommand& command_;
  const SmoothOptions& options_;
  const std::stop_token interrupt_;
  std::vector<LoadMesh> meshes_;
  Clock::time_point begin_;
  LoadRecord record_;
  std::vector<LoadFigures> windows_;
  double measured_ = 0;
  bool steady_ = false;
  std::atomic<std::int64_t> sent_ = 0, unsent_ = 0, unfinished_ = 0;
  std::atomic<int> idle_callers_ = 0;
  std::stop_source stop_;

  std::mutex mutex_;
  std::discrete_distribution<std::size_t> draw_;
  std::mt19937_64 random_;
  std::condition_variable due_changed_;
  std::deque<Due> due_;
  int waiting_callers_ = 0, open_callers_ = 0;

  std::vector<std::jthread> open_;  // made by the one that lets jobs come due
  std::vector<std::jthread> callers_;
};

void print(const BenchCommand& command, Load& load, const LoadFigures& f) {
  const std::string kind = command.rate
                               ? fmt::format("open loop, {} jobs/s due", *command.rate)
                               : fmt::format("closed loop, {} clients", command.client_count);
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

std::string to_json(const BenchCommand& command, const Load& load, const LoadFigures& f) {
  const auto counts = [](const std::map<std::string, std::int64_t>& by_reason) {
    std::string text;
    for (const auto& [reason, count] : by_reason) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", quoted(reason), count);
    }
    return "{" + text + "}";
  };
  std::string sizes;
  for (const std::string& size : command.sizes) sizes += (sizes.empty() ? "" : ", ") + quoted(size);
  return fmt::format(
      "{{\n  \"loop\": \"{}\",\n  \"client_count\": {},\n  \"due_jobs_per_second\": {},\n"
      "  \"nodes\": [{}],\n  \"steady\": {},\n  \"window_count\": {},\n  \"seconds\": {},\n"
      "  \"jobs_per_second\": {},\n  \"megabytes_up_per_second\": {},\n"
      "  \"megabytes_down_per_second\": {},\n  \"latency_seconds\": {{\"p50\": {}, \"p90\": {}, "
      "\"p99\": {}, \"p99.9\": {}, \"max\": {}}},\n  \"ok\": {},\n  \"refused\": {},\n"
      "  \"refused_by_reason\": {},\n  \"failed\": {},\n  \"failed_by_reason\": {},\n"
      "  \"unsent\": {},\n  \"unfinished\": {}\n}}\n",
      command.rate ? "open" : "closed", command.rate ? 0 : command.client_count,
      command.rate.value_or(0), sizes, load.steady(), load.window_count(), f.seconds,
      f.jobs_per_second, f.megabytes_up_per_second, f.megabytes_down_per_second, f.p50, f.p90,
      f.p99, f.p999, f.max, f.ok_count, f.refused_count, counts(f.refused), f.failed_count,
      counts(f.failed), load.unsent_count(), load.unfinished_count());
}

ExitCode run(const BenchCommand& command) {
  const Interrupt interrupt;
  const SmoothOptions options = to_smooth_options(command.smoothing);
  (void)command.server.connect().server_info();  // nobody there is no figure
  Load load(command, options, interrupt.token());
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
      "Load a server and say what it bears. Ends when three windows are within 10 %, or at a "
      "limit, or on Ctrl-C; says what was measured in any case");
  add_server_flags(*sub, command->server);
  CLI::Option* clients =
      sub->add_option("--clients", command->client_count,
                      "Closed loop: so many clients, each sends its next job after the last")
          ->check(CLI::Range(1, 10'000))
          ->capture_default_str();
  sub->add_option("--rate", command->rate,
                  "Open loop: so many jobs a second, whatever becomes of them")
      ->check(CLI::Range(1e-3, 1e6))
      ->excludes(clients);
  sub->add_option("--max-in-flight", command->max_in_flight,
                  "Of an open loop; what comes due beyond is counted as never sent")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  sub->add_option("--nodes", command->sizes,
                  "Sizes of the meshes (a pipe of tetrahedra), NODES or NODES:WEIGHT")
      ->delimiter(',')
      ->capture_default_str();
  sub->add_flag("--single", command->single, "Positions in float32");
  sub->add_option("--window", command->window_seconds, "Seconds of a window")
      ->check(CLI::Range(0.05, 3600.0))
      ->capture_default_str();
  sub->add_option("--seconds", command->max_seconds, "At most")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  sub->add_option("--jobs", command->max_jobs, "At most")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{100'000'000}))
      ->capture_default_str();
  sub->add_option("--seed", command->seed, "Of what is drawn by lot")->capture_default_str();
  sub->add_option("--json", command->json, "Write the figures to this file too");
  add_smooth_flags(*sub, command->smoothing);
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "bench/load.hpp"
#include "connection.hpp"
#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

/// The load that `bench` puts on a server.
struct LoadSettings {
  ServerAddress server;
  std::vector<std::string> sizes = {"5000"};
  int client_count = 4;
  std::optional<double> rate;  // jobs a second of an open loop; unset: a closed loop
  int max_in_flight = 256;     // of an open loop
  double window_seconds = 1;
  double max_seconds = 60;
  std::int64_t max_jobs = 1'000'000;
  bool single = false;
  std::uint64_t seed = 1;
};

struct LoadMesh {
  Mesh mesh;
  std::int64_t bytes_up = 0, bytes_down = 0;
};

/// Sends jobs drawn at random from the sizes, each caller over its own connection. Nothing is sent
/// twice: a refusal is counted as one.
class LoadGenerator {
 public:
  LoadGenerator(const LoadSettings& settings, const SmoothOptions& options,
                std::stop_token interrupt);

  /// Until the load is steady, has lasted or sent as much as it may, or is interrupted.
  void run();

  [[nodiscard]] bool steady() const { return steady_; }
  [[nodiscard]] std::int64_t unsent_count() const { return unsent_; }
  [[nodiscard]] std::int64_t unfinished_count() const { return unfinished_; }
  [[nodiscard]] std::size_t window_count() const { return windows_.size(); }
  [[nodiscard]] const std::vector<LoadMesh>& meshes() const { return meshes_; }
  /// Of the last three windows when they were steady, else of all but the first, in which
  /// connections are made.
  [[nodiscard]] LoadFigures figures() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Due {
    Clock::time_point time;
    std::size_t mesh;
  };

  std::size_t draw();
  bool may_send() { return sent_++ < settings_.max_jobs; }
  void run_closed();
  /// Poisson arrivals; a caller for each job in flight.
  void run_open();
  void arrive(const Due& due);
  void serve_arrivals();
  void send(client::Client& client, const Due& due);
  void measure_until_done();
  /// Whether all that may be sent was sent and has ended.
  bool done();

  const LoadSettings& settings_;
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

  std::vector<std::jthread> open_;  // made by the thread of the arrivals
  std::vector<std::jthread> callers_;
};

}  // namespace meshsmooth::cli

#include "bench/load_generator.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "generate/generate.hpp"

namespace meshsmooth::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
}

/// Or until a stop is requested.
void sleep_until(Clock::time_point time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any stopped;
  std::unique_lock lock(mutex);
  stopped.wait_until(lock, stop, time, [] { return false; });
}

LoadMesh make_load_mesh(const LoadSize& size, bool single) {
  LoadMesh made{formats::generate_pipe(size.node_count, 1), 0, 0};
  if (single) {
    std::vector<Vec3f> positions;
    for (const Vec3d& p : std::get<std::vector<Vec3d>>(made.mesh.positions)) {
      positions.push_back(vec3_cast<float>(p));
    }
    made.mesh.positions = std::move(positions);
  }
  const std::size_t position_bytes = single ? sizeof(Vec3f) : sizeof(Vec3d);
  made.bytes_down = static_cast<std::int64_t>(made.mesh.node_count() * position_bytes);
  made.bytes_up = made.bytes_down;
  for (const ElementBlock& block : made.mesh.blocks) {
    made.bytes_up += static_cast<std::int64_t>(block.nodes.size() * sizeof(NodeId));
  }
  return made;
}

}  // namespace

LoadGenerator::LoadGenerator(const LoadSettings& settings, const SmoothOptions& options,
                             std::stop_token interrupt)
    : settings_(settings), options_(options), interrupt_(std::move(interrupt)) {
  std::vector<double> weights;
  for (const std::string& text : settings.sizes) {
    const LoadSize size = parse_load_size(text);
    meshes_.push_back(make_load_mesh(size, settings.single));
    weights.push_back(size.weight);
  }
  draw_ = std::discrete_distribution<std::size_t>(weights.begin(), weights.end());
  random_.seed(settings.seed);
}

void LoadGenerator::run() {
  begin_ = Clock::now();
  if (settings_.rate) {
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

LoadFigures LoadGenerator::figures() const {
  const double end = std::max(measured_, 1e-9);
  const double window = settings_.window_seconds;
  const double from = steady_ ? end - 3 * window : windows_.size() > 1 ? window : 0;
  return figures_of(record_.samples(), from, end);
}

std::size_t LoadGenerator::draw() {
  const std::lock_guard lock(mutex_);
  return draw_(random_);
}

void LoadGenerator::run_closed() {
  for (int c = 0; c < settings_.client_count; ++c) {
    callers_.emplace_back([this] {
      client::Client client = settings_.server.connect();
      while (!stop_.stop_requested() && may_send()) send(client, {Clock::now(), draw()});
      ++idle_callers_;
    });
  }
}

void LoadGenerator::run_open() {
  callers_.emplace_back([this] {
    std::exponential_distribution<double> gap(*settings_.rate);
    std::mt19937_64 random(settings_.seed + 1);
    auto due = begin_;
    while (!stop_.stop_requested() && may_send()) {
      due += std::chrono::duration_cast<Clock::duration>(Seconds(gap(random)));
      sleep_until(std::min(due, begin_ + to_duration(settings_.max_seconds)), stop_.get_token());
      if (Clock::now() < due) break;  // stopped, or its time would come after the end
      arrive({due, draw()});
    }
    ++idle_callers_;
  });
}

void LoadGenerator::arrive(const Due& due) {
  std::unique_lock lock(mutex_);
  if (waiting_callers_ == 0 || due_.size() >= static_cast<std::size_t>(waiting_callers_)) {
    if (open_callers_ >= settings_.max_in_flight) {
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

void LoadGenerator::serve_arrivals() {
  client::Client client = settings_.server.connect();
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

void LoadGenerator::send(client::Client& client, const Due& due) {
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

void LoadGenerator::measure_until_done() {
  const auto window = to_duration(settings_.window_seconds);
  const auto limit = begin_ + to_duration(settings_.max_seconds);
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
        figures_of(record_.samples(), measured_ - settings_.window_seconds, measured_));
    steady_ = is_steady(windows_);
    if (Clock::now() >= limit) return;
  }
}

bool LoadGenerator::done() {
  const std::lock_guard lock(mutex_);
  return idle_callers_ == static_cast<int>(callers_.size()) && due_.empty() &&
         waiting_callers_ == open_callers_;
}

}  // namespace meshsmooth::cli

#include "gpu/lanes.hpp"

#include <barrier>
#include <chrono>
#include <cstring>
#include <exception>
#include <thread>

#include "gpu/product.hpp"

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kJobsPerLane = 300;
constexpr int kWarmUps = 20;

/// A lane's own smoother, and its jobs' positions, which lie ready before the
/// clock starts: nothing but `smooth` is timed.
class Lane {
 public:
  explicit Lane(const std::vector<Vec3f>& input)
      : smoother_(make_smoother("cuda")),
        node_count_(input.size()),
        positions_(input.size() * (kJobsPerLane + kWarmUps)) {
    for (int job = 0; job < kJobsPerLane + kWarmUps; ++job) {
      std::copy(input.begin(), input.end(), of(job).begin());
    }
  }

  void run(const TopologyView& topology, const SmoothOptions& options, int first, int last) {
    for (int job = first; job < last; ++job) smoother_->smooth(topology, of(job), options, {});
  }

  [[nodiscard]] std::span<Vec3f> of(int job) {
    return {positions_.data() + static_cast<std::size_t>(job) * node_count_, node_count_};
  }

 private:
  std::unique_ptr<Smoother> smoother_;
  std::size_t node_count_;
  PinnedArray<Vec3f> positions_;
};

LaneFigures measure(int lane_count, const BenchMesh& mesh, const PinnedTopology& topology,
                    const SmoothOptions& options, std::vector<Vec3f>& expected) {
  const std::vector<Vec3f> input = mesh.float_positions();
  std::vector<std::unique_ptr<Lane>> lanes;
  for (int lane = 0; lane < lane_count; ++lane) lanes.push_back(std::make_unique<Lane>(input));

  // A lane that fails keeps coming to the barrier, so that nobody waits for ever.
  std::vector<std::exception_ptr> failures(lanes.size());
  Clock::time_point begin;
  std::barrier start(lane_count, [&]() noexcept { begin = Clock::now(); });
  std::vector<std::thread> threads;
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    threads.emplace_back([&, lane] {
      const auto attempt = [&](int first, int last) {
        if (failures[lane] != nullptr) return;
        try {
          lanes[lane]->run(topology.view(), options, first, last);
        } catch (...) {
          failures[lane] = std::current_exception();
        }
      };
      attempt(0, kWarmUps);
      start.arrive_and_wait();
      attempt(kWarmUps, kWarmUps + kJobsPerLane);
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::chrono::duration<double> elapsed = Clock::now() - begin;
  for (const std::exception_ptr& failure : failures) {
    if (failure != nullptr) std::rethrow_exception(failure);
  }

  if (expected.empty()) {
    const auto result = lanes.front()->of(kWarmUps);
    expected.assign(result.begin(), result.end());
  }
  LaneFigures figures;
  figures.lane_count = lane_count;
  figures.job_count = lane_count * kJobsPerLane;
  figures.jobs_per_second = figures.job_count / elapsed.count();
  for (const auto& lane : lanes) {
    for (int job = 0; job < kWarmUps + kJobsPerLane; ++job) {
      const auto result = lane->of(job);
      if (std::memcmp(result.data(), expected.data(), result.size_bytes()) != 0) {
        ++figures.different_count;
      }
    }
  }
  return figures;
}

}  // namespace

std::vector<LaneFigures> measure_lanes(const BenchMesh& mesh, double tolerance,
                                       const std::vector<int>& lane_counts) {
  const PinnedTopology topology(mesh);
  const SmoothOptions options = plain_options(tolerance);
  std::vector<LaneFigures> all;
  std::vector<Vec3f> expected;
  for (const int lane_count : lane_counts) {
    all.push_back(measure(lane_count, mesh, topology, options, expected));
  }
  return all;
}

}  // namespace meshsmooth::bench

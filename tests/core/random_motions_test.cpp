// Move under many motions: whatever the boundary does, the result is valid and says how far it
// came.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/motions.hpp"

namespace meshsmooth {
namespace {

using test::Job;
using test::Motion;
using test::points;
namespace oracle = test::oracle;

/// How many random motions; the goals were measured with MESHSMOOTH_RANDOM_MOTIONS=1000.
int random_motion_count() {
  const char* const given = std::getenv("MESHSMOOTH_RANDOM_MOTIONS");
  return given == nullptr ? 21 : std::atoi(given);
}

Mesh unit_stack() {
  return test::mapped(test::noisy(test::mixed_stack(4), 0.1, 5), [](Vec3d p) {
    return Vec3d{0.25 * p.x, 0.25 * p.y, p.z / 3};
  });
}

/// Each element, and all volume elements in one mesh.
std::vector<Mesh> references() {
  std::vector<Mesh> meshes;
  for (const ElementType type : kLinearTypes) {
    meshes.push_back(test::unit_lattice(type, element_shape(type).dimension == 2 ? 8 : 4));
  }
  meshes.push_back(unit_stack());
  return meshes;
}

/// By the oracle, which shares no code with the smoother.
bool is_valid(const Mesh& mesh) {
  const oracle::Points at = oracle::to_points(mesh);
  for (const oracle::Element& element : oracle::elements(mesh)) {
    if (!(oracle::quality(element.type, oracle::corners(element, at)).mean_ratio > 0)) return false;
  }
  return true;
}

/// Moves, and checks what holds of every motion.
Job moved(const Motion& motion, const SmoothOptions& options) {
  Job job = test::smooth(motion.reference, options, motion.input());
  const MotionStats& stats = job.summary.motion.value();
  EXPECT_TRUE(is_valid(job.mesh));
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
  EXPECT_GE(stats.reached, 0);
  EXPECT_LE(stats.reached, 1);
  // A motion that ends early says so.
  EXPECT_EQ(stats.reached<1, stats.blocking_element_count> 0);
  for (std::size_t n = 0; n < motion.nodes.size(); ++n) {
    const auto node = static_cast<std::size_t>(motion.nodes[n]);
    const Vec3d from = points(motion.reference)[node];
    const Vec3d wanted = stats.reached == 1 ? motion.positions[n]
                                            : from + stats.reached * (motion.positions[n] - from);
    EXPECT_LE(norm(points(job.mesh)[node] - wanted), stats.reached == 1 ? 0 : 1e-12);
  }
  return job;
}

TEST(RandomMotions, AreValidAndReachLessTheLargerTheyAre) {
  constexpr std::array<double, 4> kFactors = {1, 2, 4, 8};
  constexpr double kLeastStep = 1.0 / 16;
  const std::vector<Mesh> meshes = references();
  const int count = random_motion_count();
  int whole = 0;
  for (int seed = 0; seed < count; ++seed) {
    double reached_before = 1;
    for (const double factor : kFactors) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", factor " + std::to_string(factor));
      const Motion motion =
          test::random_motion(meshes[static_cast<std::size_t>(seed) % meshes.size()],
                              static_cast<unsigned>(seed), 0.03 * factor);
      const Job job = moved(motion, motion.options({.least_step = kLeastStep}));
      const double reached = job.summary.motion->reached;
      EXPECT_LE(reached, reached_before + kLeastStep);
      EXPECT_EQ(reached < 1, job.summary.stop_reason == StopReason::stagnated)
          << static_cast<int>(job.summary.stop_reason) << " after "
          << job.summary.convergence.iteration_count;
      whole += reached == 1 ? 1 : 0;
      reached_before = reached;
    }
  }
  const int all = count * static_cast<int>(kFactors.size());
  EXPECT_GT(whole, 0);
  EXPECT_LT(whole, all);
  RecordProperty("whole", std::to_string(whole) + " of " + std::to_string(all));
}

TEST(Cycle, EndsWhereItBeganAndNeverFarFromTheOptimum) {
  constexpr int kSteps = 60;
  const Motion start = test::turned_hub(12, 0);
  double least = 1;
  for (int step = 0; step <= kSteps; ++step) {
    const double degrees = 30 * std::sin(2 * std::numbers::pi * (step % kSteps) / kSteps);
    const Motion motion = test::turned_hub(12, degrees);
    const Job job = moved(motion, motion.options());
    EXPECT_EQ(job.summary.motion->reached, 1) << degrees;
    if (step == kSteps) {
      EXPECT_TRUE(test::same_bits(job.mesh, start.reference));
    }
    SmoothOptions tight = motion.options();
    tight.tolerance = {1e-9};
    const double optimum = test::mean_ratio(moved(motion, tight).summary.quality_after).min;
    least = std::min(least, test::mean_ratio(job.summary.quality_after).min / optimum);
  }
  EXPECT_GE(least, 0.98);
}

/// Powers of two change no digit.
TEST(Units, DoNotMatter) {
  const Motion plain = test::turned_hub(8, 60);
  const Job expected = moved(plain, plain.options());
  for (const int power : {-100, -60, -20, 20, 60, 100}) {
    SCOPED_TRACE(power);
    const double unit = std::ldexp(1.0, power);
    Motion scaled = plain;
    for (Vec3d& p : points(scaled.reference)) p = unit * p;
    for (Vec3d& p : scaled.positions) p = unit * p;
    const Job job = test::smooth(scaled.reference, scaled.options(), scaled.input());
    EXPECT_EQ(job.summary.motion->reached, 1);
    EXPECT_EQ(job.summary.motion->linear_iteration_count,
              expected.summary.motion->linear_iteration_count);
    EXPECT_TRUE(test::same_bits(test::mapped(job.mesh, [=](Vec3d p) { return (1 / unit) * p; }),
                                expected.mesh));
  }
}

TEST(Prescribed, MayBeEveryNode) {
  Motion motion = test::turned_hub(6, 30);
  motion.nodes.clear();
  motion.positions.clear();
  for (std::size_t node = 0; node < motion.reference.node_count(); ++node) {
    motion.nodes.push_back(static_cast<NodeId>(node));
    motion.positions.push_back(2.0 * points(motion.reference)[node]);
  }
  EXPECT_EQ(moved(motion, motion.options()).summary.motion->reached, 1);
  motion.positions[100] = motion.positions[0];
  EXPECT_LT(moved(motion, motion.options()).summary.motion->reached, 1);
}

TEST(Prescribed, MayLieInsideOrInNoElement) {
  Motion motion = test::turned_hub(8, 0);
  const auto inner = static_cast<NodeId>(4 * 32 + 5);
  motion.reference = test::with_isolated_node(motion.reference);
  const auto isolated = static_cast<NodeId>(motion.reference.node_count() - 1);
  motion.nodes = {inner, isolated};
  const auto at = [&](NodeId node) {
    return points(motion.reference)[static_cast<std::size_t>(node)];
  };
  motion.positions = {at(inner) + Vec3d{0.1, 0, 0}, {7, 8, 9}};
  const Job job = moved(motion, motion.options());
  EXPECT_EQ(job.summary.motion->reached, 1);
  EXPECT_GT(job.summary.nodes.moved, 2);
}

TEST(Prescribed, IsRefusedBeyondTheRangeOfSinglePrecision) {
  Motion motion = test::turned_hub(6, 30);
  motion.positions[3] = {1e300, -1e300, 0};
  EXPECT_THROW(test::smooth(motion.reference, motion.options(), motion.input()), Error);
  motion.positions[3] = {1e15, -1e15, 0};
  EXPECT_LT(moved(motion, motion.options()).summary.motion->reached, 1);
}

// --- ends before their time ------------------------------------------------------------------

/// A motion that has every phase, and takes long enough to be met in each.
const Motion& long_motion() {
  static const Motion motion = test::turned_hub(20, 150, 20);
  return motion;
}

TEST(Interrupted, AtEachStageLeavesThePositions) {
  using Clock = std::chrono::steady_clock;
  const Motion motion = test::turned_hub(12, 60);
  for (const Stage stage : {Stage::find_neighbours, Stage::find_boundary, Stage::iterate}) {
    for (const int iteration : {0, 1, 5}) {
      if (stage != Stage::iterate && iteration > 0) continue;
      SCOPED_TRACE(std::to_string(static_cast<int>(stage)) + ' ' + std::to_string(iteration));
      const auto at = [=](const Progress& progress) {
        return progress.stage == stage && progress.iteration == iteration;
      };
      std::stop_source source;
      JobControl cancelled;
      cancelled.stop = source.get_token();
      cancelled.on_progress = [&](const Progress& progress) {
        if (at(progress)) source.request_stop();
      };
      Mesh mesh = motion.reference;
      EXPECT_THROW(
          make_smoother("cpu", 2)->smooth(mesh, motion.options(), cancelled, motion.input()),
          Cancelled);
      EXPECT_TRUE(test::same_bits(mesh, motion.reference));

      JobControl late;
      late.deadline = Clock::now() + std::chrono::milliseconds(200);
      late.on_progress = [&](const Progress& progress) {
        while (at(progress) && Clock::now() < *late.deadline) {
        }
      };
      EXPECT_THROW(make_smoother("cpu", 2)->smooth(mesh, motion.options(), late, motion.input()),
                   DeadlineExceeded);
      EXPECT_TRUE(test::same_bits(mesh, motion.reference));
    }
  }
}

/// The promise is 100 ms; what else runs on the machine may take a second more.
TEST(Interrupted, AtAnyTimeEndsSoon) {
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;
  const Motion& motion = long_motion();
  const auto smoother = make_smoother("cpu", 2);
  double longest = 0;
  for (const double delay : {0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8}) {
    std::stop_source source;
    std::atomic<bool> begun = false;
    JobControl control;
    control.stop = source.get_token();
    control.on_progress = [&](const Progress&) { begun = true; };
    Clock::time_point asked;
    std::jthread canceller([&] {
      while (!begun) std::this_thread::yield();
      std::this_thread::sleep_for(Seconds(delay));
      asked = Clock::now();
      source.request_stop();
    });
    Mesh mesh = motion.reference;
    EXPECT_THROW(smoother->smooth(mesh, motion.options(), control, motion.input()), Cancelled);
    const auto ended = Clock::now();
    canceller.join();
    longest = std::max(longest, Seconds(ended - asked).count());
    EXPECT_TRUE(test::same_bits(mesh, motion.reference));
  }
  EXPECT_LT(longest, 2.0);
  RecordProperty("longest_ms", std::to_string(1000 * longest));
}

}  // namespace
}  // namespace meshsmooth

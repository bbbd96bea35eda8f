// How fast a running job hears that it should end. These run alone: what else is
// on the device would be measured too.

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "meshsmooth/error.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using std::chrono::milliseconds;
using test::same_bits;
using Clock = std::chrono::steady_clock;

constexpr double kPromptSeconds = 0.1;

double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

/// Three million tetrahedra.
const Mesh& large_mesh() {
  static const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 79), 0.1, 1);
  return mesh;
}

/// Short steps, which fall slowly, but not so slowly that the job is taken to
/// stagnate: on the large mesh even the slowest mode of the noise loses 1.7 % in 50
/// sweeps. It takes tens of thousands of sweeps until nothing moves.
constexpr double kShortStep = 0.25;

SmoothOptions endless(const test::Way& way) {
  return test::sweeps(1'000'000'000, way.method, way.form);
}

const test::Way kEndlessJacobi{"jacobi", Laplacian{.relaxation = kShortStep}, Form::jacobi};

std::vector<test::Way> endless_ways() {
  return {kEndlessJacobi,
          {"gauss_seidel", Laplacian{.relaxation = kShortStep}, Form::gauss_seidel},
          {"asynchronous", Laplacian{.relaxation = kShortStep}, Form::asynchronous},
          {"by_length", Laplacian{.weighting = Weighting::edge_length, .relaxation = kShortStep},
           Form::gauss_seidel},
          {"by_volume", Laplacian{.weighting = Weighting::ball_volume, .relaxation = kShortStep},
           Form::jacobi},
          {"smart", SmartLaplacian{.relaxation = kShortStep}, Form::gauss_seidel},
          {"taubin", Taubin{.lambda = 0.6307, .mu = -0.631}, Form::jacobi},
          {"hc", HcLaplacian{}, Form::jacobi}};
}

/// A job in a thread of its own, on its way.
class RunningJob {
 public:
  RunningJob(Smoother& smoother, Mesh mesh, const SmoothOptions& options, JobControl control = {})
      : mesh_(std::move(mesh)) {
    control.stop = source_.get_token();
    control.finish_early = &finish_early_;
    control.on_progress = [this](const Progress& progress) {
      if (progress.stage == Stage::iterate && progress.iteration > 0) {
        sweeping_ = true;
        sweeping_.notify_all();
      }
    };
    thread_ = std::thread([this, &smoother, options, control] {
      try {
        summary_ = smoother.smooth(mesh_, options, control);
        ending_ = "ended by itself after " + std::to_string(summary_.convergence.iteration_count) +
                  " sweeps";
      } catch (const Error& error) {
        ending_ = error.what();
        error_ = std::current_exception();
      }
      ended_at_ = Clock::now();
      sweeping_ = true;  // nobody waits for sweeps that will not come
      sweeping_.notify_all();
    });
  }
  RunningJob(const RunningJob&) = delete;
  RunningJob& operator=(const RunningJob&) = delete;
  ~RunningJob() {
    source_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  void wait_for_sweeps() { sweeping_.wait(false); }
  void cancel() { source_.request_stop(); }
  void finish_early() { finish_early_ = true; }
  /// When smoothing returned.
  Clock::time_point end() {
    thread_.join();
    return ended_at_;
  }
  template <class Thrown>
  [[nodiscard]] bool threw() const {
    try {
      if (error_) std::rethrow_exception(error_);
    } catch (const Thrown&) {
      return true;
    } catch (...) {
    }
    return false;
  }
  [[nodiscard]] const Mesh& mesh() const { return mesh_; }
  [[nodiscard]] const SmoothSummary& summary() const { return summary_; }
  /// What became of it, for messages.
  [[nodiscard]] const std::string& ending() const { return ending_; }

 private:
  Mesh mesh_;
  std::stop_source source_;
  std::atomic<bool> finish_early_ = false;
  std::atomic<bool> sweeping_ = false;
  SmoothSummary summary_;
  std::string ending_;
  std::exception_ptr error_;
  Clock::time_point ended_at_;
  std::thread thread_;
};

class PromptlyStopping : public test::CudaTest, public testing::WithParamInterface<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Cuda, PromptlyStopping, testing::ValuesIn(endless_ways()), test::way_name);

TEST_P(PromptlyStopping, EndsWhenCancelledInMidIteration) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const Mesh& mesh : {large_mesh(), test::as_float32(large_mesh())}) {
    for (const bool guard : {false, true}) {
      SCOPED_TRACE(std::string(mesh.positions.index() == 1 ? "float64" : "float32") +
                   (guard ? ", guarded" : ", bare"));
      SmoothOptions options = endless(GetParam());
      options.guard = guard;
      RunningJob job(*smoother, mesh, options);
      job.wait_for_sweeps();
      const Clock::time_point asked = Clock::now();
      job.cancel();

      EXPECT_LT(seconds(job.end() - asked), kPromptSeconds);
      EXPECT_TRUE(job.threw<Cancelled>()) << job.ending();
      EXPECT_TRUE(same_bits(job.mesh(), mesh)) << "positions were touched";
    }
  }
}

class Promptly : public test::CudaTest {
 protected:
  void SetUp() override {
    test::CudaTest::SetUp();
    if (!IsSkipped() && !HasFailure()) smoother = make_smoother("cuda");
  }

  std::unique_ptr<Smoother> smoother;
};

TEST_F(Promptly, HandsOverWhatItHasWhenToldToFinishEarly) {
  RunningJob job(*smoother, large_mesh(), endless(kEndlessJacobi));
  job.wait_for_sweeps();
  job.finish_early();
  job.end();

  EXPECT_EQ(job.summary().stop_reason, StopReason::cancelled_with_result) << job.ending();
  EXPECT_GT(job.summary().convergence.iteration_count, 0);
  EXPECT_GT(job.summary().nodes.moved, 0);
  EXPECT_FALSE(same_bits(job.mesh(), large_mesh()));
}

TEST_F(Promptly, EndsWhenTheDeadlineHasPassed) {
  Mesh warm_up = large_mesh();
  smoother->smooth(warm_up, test::sweeps(1, Laplacian{}));
  const Clock::time_point deadline = Clock::now() + milliseconds(700);
  JobControl control;
  control.deadline = deadline;
  RunningJob job(*smoother, large_mesh(), endless(kEndlessJacobi), control);
  job.wait_for_sweeps();
  const Clock::time_point sweeping = Clock::now();

  const Clock::time_point end = job.end();

  EXPECT_LT(seconds(sweeping - deadline), 0) << "the sweeps began too late: nothing was tested";
  EXPECT_GE(seconds(end - deadline), 0);
  EXPECT_LT(seconds(end - deadline), kPromptSeconds);
  EXPECT_TRUE(job.threw<DeadlineExceeded>()) << job.ending();
  EXPECT_TRUE(same_bits(job.mesh(), large_mesh())) << "positions were touched";
}

TEST_F(Promptly, KeepsToItsComputeBudget) {
  SmoothOptions options = endless(kEndlessJacobi);
  options.compute_budget = milliseconds(200);
  Mesh mesh = large_mesh();

  const SmoothSummary summary = smoother->smooth(mesh, options);

  EXPECT_EQ(summary.stop_reason, StopReason::compute_budget);
  EXPECT_GT(summary.convergence.iteration_count, 0);
  EXPECT_GT(summary.nodes.moved, 0);
  EXPECT_GE(summary.times.iterate_seconds, 0.2);
  EXPECT_LT(summary.times.iterate_seconds, 0.3);
}

TEST_F(Promptly, DoesNothingWhenCancelledBefore) {
  std::stop_source source;
  source.request_stop();
  JobControl control;
  control.stop = source.get_token();
  bool worked = false;
  control.on_progress = [&](const Progress&) { worked = true; };
  Mesh mesh = large_mesh();

  EXPECT_THROW(smoother->smooth(mesh, endless(kEndlessJacobi), control), Cancelled);

  EXPECT_FALSE(worked);
  EXPECT_TRUE(same_bits(mesh, large_mesh()));
}

TEST_F(Promptly, SmoothsTheNextJobAfterACancelledOne) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 13), 0.1, 1);
  const SmoothOptions options = test::sweeps(5, Laplacian{});
  const test::Job expected = test::smooth(mesh, options);
  for (const Stage stage :
       {Stage::find_neighbours, Stage::find_boundary, Stage::evaluate, Stage::iterate}) {
    std::stop_source source;
    JobControl control;
    control.stop = source.get_token();
    control.on_progress = [&](const Progress& progress) {
      if (progress.stage == stage) source.request_stop();
    };
    Mesh cancelled = mesh;
    EXPECT_THROW(smoother->smooth(cancelled, endless(kEndlessJacobi), control), Cancelled);
    EXPECT_TRUE(same_bits(cancelled, mesh)) << "positions were touched";
    Mesh next = mesh;

    smoother->smooth(next, options);

    EXPECT_LT(test::difference(next, test::oracle::to_points(expected.mesh)), 1e-12);
  }
}

TEST_F(Promptly, ReportsProgressStageByStage) {
  std::vector<Stage> stages;
  std::vector<int> iterations;
  const std::thread::id own = std::this_thread::get_id();
  JobControl control;
  control.on_progress = [&](const Progress& progress) {
    EXPECT_EQ(std::this_thread::get_id(), own);
    if (stages.empty() || stages.back() != progress.stage) stages.push_back(progress.stage);
    if (progress.stage == Stage::iterate) iterations.push_back(progress.iteration);
  };
  Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 13), 0.1, 1);
  SmoothOptions options = endless(kEndlessJacobi);
  options.max_iterations = 300;

  smoother->smooth(mesh, options, control);

  EXPECT_THAT(stages, testing::ElementsAre(Stage::find_neighbours, Stage::find_boundary,
                                           Stage::evaluate, Stage::iterate, Stage::evaluate));
  // A device does several sweeps at a stretch, so not each need be told.
  ASSERT_GE(iterations.size(), 3U);
  EXPECT_EQ(iterations.front(), 0);
  EXPECT_EQ(iterations.back(), 300);
  EXPECT_TRUE(std::is_sorted(iterations.begin(), iterations.end()));
}

}  // namespace
}  // namespace meshsmooth

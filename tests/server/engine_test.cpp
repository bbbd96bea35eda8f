// The engine without gRPC: what its threads do to each other.
#include "engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "machine_limits.hpp"
#include "meshsmooth/error.hpp"
#include "support/fake_smoother.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::server {
namespace {

using testing::FakeControl;
using testing::FakeSmoother;

// Plays the call's part: sends the mesh, takes the result, ends the job when it
// is its turn.
class Caller {
 public:
  explicit Caller(Engine& engine) : engine_(engine) {}

  bool admit() {
    JobRequest request;
    request.layout.node_count = 4;
    request.layout.blocks = {{ElementType::tetrahedron, 1}};
    request.layout.elements_bytes = 16;
    request.layout.coordinates_bytes = 96;
    try {
      // The lane may still be telling when the caller is gone.
      subscription_ = engine_.admit(std::move(request), [signal = signal_] {
        { const std::lock_guard lock(signal->mutex); }
        signal->changed.notify_all();
      });
      job_ = subscription_.job;
      return true;
    } catch (const Error&) {
      return false;
    }
  }

  void submit() {
    v1::Chunk chunk;
    chunk.set_array_id(v1::ARRAY_ID_ELEMENTS);
    chunk.set_data(std::string(16, '\0'));
    job_->mesh().add(chunk);
    chunk.set_array_id(v1::ARRAY_ID_COORDINATES);
    chunk.set_data(std::string(96, '\0'));
    job_->mesh().add(chunk);
    engine_.submit(job_);
  }

  // Waits for the lane; then sends, that is, looks at the result.
  JobState finish() {
    std::unique_lock lock(signal_->mutex);
    signal_->changed.wait(lock, [this] {
      const JobState state = job_->state();
      return has_ended(state) || state == JobState::sending;
    });
    lock.unlock();
    if (job_->state() == JobState::sending) {
      double x = 0;
      std::memcpy(&x, job_->snapshot().result->coordinates.data(), sizeof x);
      EXPECT_EQ(x, 1.0);
      job_->end(job_->stop_cause());
    }
    engine_.leave(subscription_, nullptr);
    return job_->state();
  }

  Job& job() { return *job_; }
  /// The reason of a job that failed.
  std::string failure() {
    try {
      std::rethrow_exception(job_->snapshot().error);
    } catch (const Error& error) {
      return error.reason();
    }
  }

 private:
  struct Signal {
    std::mutex mutex;
    std::condition_variable changed;
  };

  Engine& engine_;
  const std::shared_ptr<Signal> signal_ = std::make_shared<Signal>();
  Subscription subscription_;
  std::shared_ptr<Job> job_;
};

class EngineTest : public ::testing::Test {
 protected:
  static ServerConfig config() {
    ServerConfig config = testing::quiet_config();
    config.lanes = 2;
    return config;
  }

  void expect_balanced() {
    EXPECT_TRUE(engine_.store().living().empty());
    EXPECT_EQ(engine_.memory_budget().reserved().host_bytes, 0);
  }

  static std::exception_ptr cancelled() { return std::make_exception_ptr(Cancelled("WHY", "")); }

  std::shared_ptr<FakeControl> fake_ = std::make_shared<FakeControl>();
  Engine engine_{config(), [fake = fake_] { return std::make_unique<FakeSmoother>(fake); }};
};

TEST_F(EngineTest, FillsInTheDefaultsThatDependOnTheMachine) {
  ServerConfig config;
  config.lanes = 1;
  const Engine engine(config, [this] { return std::make_unique<FakeSmoother>(fake_); });

  EXPECT_EQ(engine.config().threads_per_lane, available_cores());
  EXPECT_GT(engine.config().host_memory_limit_bytes, 0);
  EXPECT_EQ(engine.config().max_job_bytes, engine.config().host_memory_limit_bytes / 8 * 7);
}

TEST_F(EngineTest, RunsSeveralLanesUnlessToldOtherwise) {
  ServerConfig config = testing::quiet_config();
  config.lanes = 0;
  const Engine engine(config, [this] { return std::make_unique<FakeSmoother>(fake_); });

  EXPECT_EQ(engine.config().lanes > 1, available_cores() > 1);
  EXPECT_EQ(engine.lanes().size(), static_cast<std::size_t>(engine.config().lanes));
}

TEST_F(EngineTest, StartsOnWhateverBackendThereIs) {
  ServerConfig config = testing::quiet_config();
  config.backend = "auto";
  const Engine engine(config, {});

  EXPECT_EQ(engine.devices().front(), make_smoother("auto")->backend());
  // A better one that is not available is named.
  const BackendInfo best = list_backends().front();
  EXPECT_EQ(engine.passed_over().empty(), best.available) << engine.passed_over();
  EXPECT_NE(engine.passed_over().find(best.problem), std::string::npos);  // empty of a good one
}

TEST_F(EngineTest, RefusesDevicesOfABackendThatHasNone) {
  ServerConfig config = testing::quiet_config();
  config.backend = "cpu";
  config.devices = "0,1";
  try {
    const Engine engine(config, {});
    FAIL() << "nothing thrown";
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.details(), (ErrorDetails{{"field", "devices"}}));
  }
}

TEST_F(EngineTest, NamesWhatThereIsInsteadOfABackendThatIsNot) {
  ServerConfig config = testing::quiet_config();
  config.backend = "cuda:99";
  try {
    const Engine engine(config, {});
    FAIL() << "nothing thrown";
  } catch (const NotSupported& error) {
    EXPECT_EQ(error.reason(), "BACKEND_NOT_AVAILABLE");
    EXPECT_NE(std::string(error.what()).find("cpu"), std::string::npos) << error.what();
  }
}

// --- the device's memory ----------------------------------------------------------

class DeviceBytes : public EngineTest {
 protected:
  static constexpr std::int64_t kGiB = std::int64_t{1} << 30;

  /// With 64 GiB of which 60 are free; a lane keeps up to 2.
  std::unique_ptr<Engine> start(int lanes, std::int64_t device_bytes = 0) {
    fake_->set_device_space(
        {.total_bytes = 64 * kGiB, .free_bytes = 60 * kGiB, .kept_bytes = 2 * kGiB});
    ServerConfig config = testing::quiet_config();
    config.lanes = lanes;
    config.device_bytes = device_bytes;
    return std::make_unique<Engine>(config,
                                    [this] { return std::make_unique<FakeSmoother>(fake_); });
  }

  /// How a job that needs so much is refused; empty when it is not.
  std::string refusal(Engine& engine, std::int64_t need, ErrorDetails* details = nullptr) {
    fake_->set_estimate({.host_bytes = 0, .device_bytes = need});
    JobRequest request;
    request.layout.node_count = 4;
    request.layout.blocks = {{ElementType::tetrahedron, 1}};
    request.layout.elements_bytes = 16;
    request.layout.coordinates_bytes = 96;
    try {
      jobs_.push_back(engine.admit(std::move(request), [] {}).job);
    } catch (const OutOfMemory& error) {
      if (details != nullptr) *details = error.details();
      return error.reason();
    }
    return "";
  }

  std::vector<std::shared_ptr<Job>> jobs_;
};

TEST_F(DeviceBytes, AreWhatIsFreeLessWhatOtherLanesKeepAndAMargin) {
  EXPECT_EQ(start(1)->config().device_bytes, 58 * kGiB);
  EXPECT_EQ(start(4)->config().device_bytes, 52 * kGiB);
}

TEST_F(DeviceBytes, CanBeSetLowerButNotHigher) {
  EXPECT_EQ(start(1, kGiB)->config().device_bytes, kGiB);
  EXPECT_EQ(start(1, 100 * kGiB)->config().device_bytes, 58 * kGiB);
}

TEST_F(DeviceBytes, RefuseWhatNeverFitsByNeedAndLimit) {
  const auto engine = start(1, kGiB);
  ErrorDetails details;

  EXPECT_EQ(refusal(*engine, kGiB + 1, &details), "MESH_TOO_LARGE");

  EXPECT_EQ(details, (ErrorDetails{{"need_bytes", std::to_string(kGiB + 1)},
                                   {"limit_bytes", std::to_string(kGiB)},
                                   {"space", "device"}}));
}

TEST_F(DeviceBytes, RefuseWhatDoesNotFitNow) {
  const auto engine = start(1, kGiB);
  EXPECT_EQ(refusal(*engine, kGiB), "");

  EXPECT_EQ(refusal(*engine, 1), "DEVICE_MEMORY_BUSY");

  jobs_.front()->end();
  EXPECT_EQ(refusal(*engine, 1), "");
  jobs_.back()->end();
  EXPECT_EQ(engine->memory_budget().reserved().device_bytes.front(), 0);
}

TEST_F(DeviceBytes, DoNotSufficeForAnyNumberOfLanes) {
  try {
    start(40);
    FAIL() << "nothing thrown";
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.details(), (ErrorDetails{{"field", "lanes"}}));
  }
}

TEST_F(EngineTest, RunsJobsOfManyCallersAndGivesAllMemoryBack) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([this] {
      for (int i = 0; i < 50; ++i) {
        Caller caller(engine_);
        if (!caller.admit()) continue;
        caller.submit();
        EXPECT_EQ(caller.finish(), JobState::succeeded);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();

  expect_balanced();
}

TEST_F(EngineTest, CountsWhatAJobNeedsBeyondItsEstimate) {
  fake_->hold();
  fake_->need_more(1000);
  Caller caller(engine_);
  ASSERT_TRUE(caller.admit());
  const std::int64_t estimated = engine_.memory_budget().reserved().host_bytes;
  caller.submit();
  fake_->wait_started(1);
  EXPECT_EQ(engine_.memory_budget().reserved().host_bytes, estimated + 1000);
  fake_->release();
  EXPECT_EQ(caller.finish(), JobState::succeeded);
  expect_balanced();

  fake_->need_more(engine_.memory_budget().limit().host_bytes);
  Caller large(engine_);
  ASSERT_TRUE(large.admit());
  large.submit();
  EXPECT_EQ(large.finish(), JobState::failed);
  EXPECT_EQ(large.failure(), "MESH_TOO_LARGE");
  expect_balanced();
}

// Cancels race with submission, lane and result.
TEST_F(EngineTest, EndsEveryJobOnceWhoeverCancelsItWhenever) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([this] {
      for (int i = 0; i < 50; ++i) {
        Caller caller(engine_);
        if (!caller.admit()) continue;
        std::thread canceller([&] { engine_.cancel(caller.job(), cancelled()); });
        caller.submit();
        const JobState state = caller.finish();
        canceller.join();
        EXPECT_TRUE(has_ended(state));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();

  expect_balanced();
}

TEST_F(EngineTest, RefusesJobsOnceItIsLeaving) {
  engine_.refuse_new();

  Caller caller(engine_);
  EXPECT_FALSE(caller.admit());
  expect_balanced();
}

TEST_F(EngineTest, WaitsUntilTheLastJobHasEnded) {
  fake_->hold();
  Caller caller(engine_);
  ASSERT_TRUE(caller.admit());
  caller.submit();
  fake_->wait_started(1);
  std::thread waiter([this] { engine_.wait_idle(Clock::now() + std::chrono::hours(1), false); });
  fake_->release();
  caller.finish();

  waiter.join();
  expect_balanced();
}

class EngineWatchdog : public ::testing::Test {
 protected:
  static ServerConfig config() {
    ServerConfig config = testing::quiet_config();
    config.lane_watchdog = std::chrono::milliseconds(50);
    return config;
  }
  /// A job that runs, and does not hear that it should stop.
  std::unique_ptr<Caller> start_deaf_job() {
    fake_->hold_deaf();
    auto caller = std::make_unique<Caller>(engine_);
    EXPECT_TRUE(caller->admit());
    caller->submit();
    fake_->wait_started(++started_);
    return caller;
  }
  void cancel(Caller& caller) {
    engine_.cancel(caller.job(), std::make_exception_ptr(Cancelled("WHY", "")));
  }
  /// Until another lane takes jobs; the held one stays in the list.
  void wait_for_lanes(std::size_t count) {
    while (engine_.lanes().size() != count) std::this_thread::yield();
  }

  std::shared_ptr<FakeControl> fake_ = std::make_shared<FakeControl>();
  std::atomic<int> lost_ = 0;
  int started_ = 0;
  Engine engine_{config(), [fake = fake_] { return std::make_unique<FakeSmoother>(fake); },
                 [this] { ++lost_; }};
};

TEST_F(EngineWatchdog, ReplacesALaneThatDoesNotLetGo) {
  const auto stuck = start_deaf_job();
  cancel(*stuck);
  wait_for_lanes(2);
  EXPECT_FALSE(engine_.lanes()[0]->in_service());
  EXPECT_TRUE(engine_.lanes()[1]->in_service());

  const auto next = start_deaf_job();  // runs on the new lane
  EXPECT_EQ(lost_, 0);

  fake_->release();
  EXPECT_EQ(stuck->finish(), JobState::cancelled);
  EXPECT_EQ(next->finish(), JobState::succeeded);
  wait_for_lanes(1);
  EXPECT_EQ(engine_.lanes()[0]->number(), 1);
  EXPECT_EQ(engine_.memory_budget().reserved().host_bytes, 0);
}

TEST_F(EngineWatchdog, GivesUpWhenTheLastLaneDoesNotLetGo) {
  const auto first = start_deaf_job();
  cancel(*first);
  wait_for_lanes(2);
  const auto second = start_deaf_job();
  EXPECT_EQ(lost_, 0);

  cancel(*second);  // as many lanes hang as there were: no more are made
  while (lost_ == 0) std::this_thread::yield();
  EXPECT_FALSE(Caller(engine_).admit()) << "no lane would take it";

  engine_.close();  // does not wait for them
  fake_->release();
  EXPECT_EQ(first->finish(), JobState::cancelled);
  EXPECT_EQ(second->finish(), JobState::cancelled);
  EXPECT_EQ(lost_, 1);
}

// Memory was divided among the lanes that there were, and the kernel that hangs may block others.
TEST(EngineWatchdogBesideAGpu, TakesTheLaneOutWithoutANewOne) {
  const auto fake = std::make_shared<FakeControl>();
  fake->set_device_space({.total_bytes = 1 << 30, .free_bytes = 1 << 30});
  ServerConfig config = testing::quiet_config();
  config.lane_watchdog = std::chrono::milliseconds(50);
  config.lanes = 2;
  std::atomic<int> lost = 0;
  Engine engine(
      config, [&] { return std::make_unique<FakeSmoother>(fake); }, [&] { ++lost; });
  const auto in_service = [&] {
    return std::ranges::count_if(engine.lanes(), [](const auto& l) { return l->in_service(); });
  };
  fake->hold_deaf();
  Caller caller(engine);
  ASSERT_TRUE(caller.admit());
  caller.submit();
  fake->wait_started(1);

  engine.cancel(caller.job(), std::make_exception_ptr(Cancelled("WHY", "")));
  while (in_service() == 2) std::this_thread::yield();
  EXPECT_EQ(engine.lanes().size(), 2U);
  EXPECT_EQ(lost, 0);

  fake->release();
  EXPECT_EQ(caller.finish(), JobState::cancelled);
  while (in_service() != 2) std::this_thread::yield();  // it is back
}

TEST(EngineLimits, EndsAJobThatRunsTooLong) {
  const auto fake = std::make_shared<FakeControl>();
  ServerConfig config = testing::quiet_config();
  config.max_job_time = std::chrono::milliseconds(50);
  Engine engine(config, [&] { return std::make_unique<FakeSmoother>(fake); });
  fake->hold();
  Caller caller(engine);
  ASSERT_TRUE(caller.admit());
  caller.submit();

  EXPECT_EQ(caller.finish(), JobState::failed);
  EXPECT_EQ(caller.failure(), "RUN_TIMEOUT");
}

TEST_F(EngineTest, ExpiresOnlyJobsThatStillWait) {
  fake_->hold();
  Caller first(engine_), second(engine_), waiting(engine_);
  for (Caller* caller : {&first, &second, &waiting}) {
    ASSERT_TRUE(caller->admit());
    caller->submit();
  }
  fake_->wait_started(2);

  engine_.end_waiting(first.job(), cancelled());
  engine_.end_waiting(waiting.job(), cancelled());

  EXPECT_EQ(first.job().state(), JobState::running);
  EXPECT_EQ(waiting.job().state(), JobState::cancelled);
  fake_->release();
  EXPECT_EQ(first.finish(), JobState::succeeded);
  EXPECT_EQ(second.finish(), JobState::succeeded);
}

}  // namespace
}  // namespace meshsmooth::server

// Two callers with tokens and default settings: whatever one of them does, the other is served.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/row.hpp"
#include "server/smooth_call.hpp"
#include "support/scratch_folder.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

const Metadata kA = {{"authorization", "Bearer aaa"}}, kB = {{"authorization", "Bearer bbb"}};
constexpr std::size_t kProbes = 30;  // at least

std::chrono::system_clock::time_point soon() { return std::chrono::system_clock::now() + 30s; }

/// For which the one is busy, at least; MESHSMOOTH_TENANT_SECONDS.
std::chrono::seconds busy_time() {
  const char* const seconds = std::getenv("MESHSMOOTH_TENANT_SECONDS");
  return std::chrono::seconds(seconds == nullptr ? 0 : std::stoi(seconds));
}

void authorize(grpc::ClientContext& context, const Metadata& metadata) {
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
}

/// Everything that one caller does at once, each by a thread with a connection of its own.
class BusyCaller {
 public:
  explicit BusyCaller(const ServerProgram& server) {
    for (int i = 0; i < 3; ++i) {
      run(server, [this](Stub& stub) { run_job(stub, TwoTetrahedra::spec()); });
      run(server, [this](Stub& stub) {
        v1::JobSpec spec = TwoTetrahedra::spec();
        spec.mutable_result_ttl()->set_seconds(600);
        spec.set_priority(v1::PRIORITY_INTERACTIVE);
        attach(stub, run_job(stub, spec));
      });
      run(server, [](Stub& stub) { stall_uploads(stub); });
    }
    run(server, [](Stub& stub) { lease(stub); });
  }
  ~BusyCaller() {
    stopped_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  BusyCaller(const BusyCaller&) = delete;
  BusyCaller& operator=(const BusyCaller&) = delete;

  [[nodiscard]] int jobs() const { return jobs_; }

 private:
  void run(const ServerProgram& server, const std::function<void(Stub&)>& step) {
    threads_.emplace_back([this, channel = server.connect(), step] {
      Stub stub(channel);
      while (!stopped_) step(stub);
    });
  }
  /// Its name; empty where it was refused.
  std::string run_job(Stub& stub, const v1::JobSpec& spec) {
    SmoothCall call(stub, soon(), kA);
    call.send_all(TwoTetrahedra(), spec);
    const std::string name = call.try_read_accepted().value_or("");
    call.finish();
    ++jobs_;
    return name;
  }
  static void attach(Stub& stub, const std::string& name) {
    grpc::ClientContext context;
    context.set_deadline(soon());
    authorize(context, kA);
    v1::AttachJobRequest request;
    request.set_name(name);
    const auto reader = stub.AttachJob(&context, request);
    v1::AttachJobResponse response;
    while (reader->Read(&response)) {
    }
    reader->Finish();
  }
  // Shared memory that nobody comes for.
  static void lease(Stub& stub) {
    grpc::ClientContext context;
    authorize(context, kA);
    v1::LeaseSharedMemoryRequest request;
    request.set_size_bytes(1 << 20);
    v1::LeaseSharedMemoryResponse response;
    stub.LeaseSharedMemory(&context, request, &response);
  }
  // As much as it may announce, without sending it.
  static void stall_uploads(Stub& stub) {
    std::vector<std::unique_ptr<SmoothCall>> calls;
    for (int i = 0; i < 20; ++i) {
      v1::JobSpec spec = TwoTetrahedra::spec();
      spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(2'000'000);
      calls.push_back(std::make_unique<SmoothCall>(stub, soon(), kA));
      calls.back()->send(spec);
    }
    for (const auto& call : calls) static_cast<void>(call->try_read_accepted());
  }

  std::atomic<bool> stopped_ = false;
  std::atomic<int> jobs_ = 0;
  std::vector<std::thread> threads_;
};

TEST(Tenants, AreServedWhateverAnotherDoes) {
  const ScratchFolder folder;
  const ServerProgram server(0, {"--token-file", folder.write("tokens", "a:aaa\nb:bbb\n"),
                                 "--admin-listen", "127.0.0.1:0"});
  Stub stub(server.connect());
  v1::JobSpec kept = TwoTetrahedra::spec();
  kept.mutable_result_ttl()->set_seconds(600);
  SmoothCall first(stub, soon(), kB);
  first.send_all(TwoTetrahedra(), kept);
  const std::string name = first.read_accepted();
  ASSERT_TRUE(first.finish().ok()) << first.finish().error_message();

  std::vector<std::chrono::duration<double>> times;
  {
    const BusyCaller a(server);
    ASSERT_TRUE(eventually([&] { return a.jobs() > 100; }));
    const auto end = Clock::now() + busy_time();
    while (times.size() < kProbes || Clock::now() < end) {
      const auto begin = Clock::now();
      SmoothCall call(stub, soon(), kB);
      call.send_all(TwoTetrahedra());
      EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
      times.emplace_back(Clock::now() - begin);
    }
    // More than are listed for all callers together.
    ASSERT_TRUE(eventually([&] { return a.jobs() > 1100; }));
    std::printf("%d jobs of the one meanwhile\n", a.jobs());
  }
  std::ranges::sort(times);
  const auto median = times[times.size() / 2], late = times[times.size() * 99 / 100 - 1];
  EXPECT_LE(median, 1s);
  EXPECT_LE(late, 2s);
  std::printf("%zu jobs of the other: %.1f ms, 99 %% within %.1f ms, all within %.1f ms\n",
              times.size(), 1e3 * median.count(), 1e3 * late.count(), 1e3 * times.back().count());

  grpc::ClientContext context;
  authorize(context, kB);
  v1::GetJobRequest request;
  request.set_name(name);
  v1::GetJobResponse response;
  ASSERT_TRUE(stub.GetJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().state(), v1::STATE_SUCCEEDED);
}

v1::State state_of(Stub& stub, const std::string& name, const Metadata& metadata) {
  grpc::ClientContext context;
  authorize(context, metadata);
  v1::GetJobRequest request;
  request.set_name(name);
  v1::GetJobResponse response;
  EXPECT_TRUE(stub.GetJob(&context, request, &response).ok());
  return response.job().state();
}

/// One caller with jobs that would run for hours, over two connections, and streams over two
/// others: a connection has 128 calls.
class HoldingCaller {
 public:
  explicit HoldingCaller(const ServerProgram& server)
      : stubs_{Stub(server.connect()), Stub(server.connect())},
        attached_{Stub(server.connect()), Stub(server.connect())} {
    for (int i = 0; i < 2; ++i) {
      SmoothCall& call = calls_.emplace_back(stubs_[i], std::nullopt, kA);
      call.send(row_.spec(100'000'000, ""));
      names_.push_back(call.read_accepted());
      row_.send(call);
    }
  }
  [[nodiscard]] bool holds_lane() {
    return std::ranges::any_of(names_, [&](const std::string& name) {
      return state_of(stubs_[0], name, kA) == v1::STATE_RUNNING;
    });
  }
  void fill_queue() {
    for (int i = 0; i < 110; ++i) {
      SmoothCall& call = calls_.emplace_back(stubs_[i % 2], std::nullopt, kA);
      call.send_all(TwoTetrahedra());
      refused_ += call.try_read_accepted() ? 0 : 1;
    }
  }
  void attach() {
    for (int i = 0; i < 200; ++i) {
      grpc::ClientContext& context = contexts_.emplace_back();
      authorize(context, kA);
      v1::AttachJobRequest request;
      request.set_name(names_[i % 2]);
      readers_.push_back(attached_[i % 2].AttachJob(&context, request));
    }
  }
  ~HoldingCaller() {
    for (grpc::ClientContext& context : contexts_) context.TryCancel();
    for (const auto& reader : readers_) reader->Finish();
  }
  HoldingCaller(const HoldingCaller&) = delete;
  HoldingCaller& operator=(const HoldingCaller&) = delete;

  [[nodiscard]] int refused() const { return refused_; }

 private:
  const Row row_{600'000};
  std::array<Stub, 2> stubs_, attached_;
  std::vector<std::string> names_;
  std::list<SmoothCall> calls_;
  std::list<grpc::ClientContext> contexts_;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::AttachJobResponse>>> readers_;
  int refused_ = 0;
};

TEST(Tenants, AreServedWhileAnotherHoldsLaneQueueAndStreams) {
  const ScratchFolder folder;
  const ServerProgram server(0, {"--token-file", folder.write("tokens", "a:aaa\nb:bbb\n"),
                                 "--admin-listen", "127.0.0.1:0"});
  Stub stub(server.connect());
  HoldingCaller a(server);
  ASSERT_TRUE(eventually([&] { return a.holds_lane(); }));
  const auto expect_served = [&](const std::string& what) {
    SCOPED_TRACE(what);
    std::vector<std::chrono::duration<double>> times;
    while (times.size() < 10) {
      const auto begin = Clock::now();
      SmoothCall call(stub, soon(), kB);
      call.send_all(TwoTetrahedra());
      EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
      times.emplace_back(Clock::now() - begin);
    }
    EXPECT_TRUE(a.holds_lane());
    std::ranges::sort(times);
    EXPECT_LE(times[times.size() / 2], 1s);
    EXPECT_LE(times.back(), 2s);
  };
  expect_served("lane");
  a.fill_queue();
  EXPECT_GT(a.refused(), 0) << "the queue is not full";
  expect_served("queue");
  a.attach();
  expect_served("streams");
}

}  // namespace
}  // namespace meshsmooth::testing

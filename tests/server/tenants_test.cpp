// Two callers with tokens and default settings: whatever one of them does, the other is served.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/smooth_call.hpp"
#include "support/scratch_folder.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

const Metadata kA = {{"authorization", "Bearer aaa"}}, kB = {{"authorization", "Bearer bbb"}};
constexpr int kProbes = 30;

std::chrono::system_clock::time_point soon() { return std::chrono::system_clock::now() + 30s; }

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
    for (const auto& [key, value] : kA) context.AddMetadata(key, value);
    v1::AttachJobRequest request;
    request.set_name(name);
    const auto reader = stub.AttachJob(&context, request);
    v1::AttachJobResponse response;
    while (reader->Read(&response)) {
    }
    reader->Finish();
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
    for (int i = 0; i < kProbes; ++i) {
      const auto begin = Clock::now();
      SmoothCall call(stub, soon(), kB);
      call.send_all(TwoTetrahedra());
      EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
      times.emplace_back(Clock::now() - begin);
    }
    // More than are listed for all callers together.
    ASSERT_TRUE(eventually([&] { return a.jobs() > 1100; }));
  }
  std::ranges::sort(times);
  EXPECT_LE(times[kProbes / 2], 1s);
  EXPECT_LE(times[kProbes - 2], 2s);

  grpc::ClientContext context;
  for (const auto& [key, value] : kB) context.AddMetadata(key, value);
  v1::GetJobRequest request;
  request.set_name(name);
  v1::GetJobResponse response;
  ASSERT_TRUE(stub.GetJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().state(), v1::STATE_SUCCEEDED);
}

}  // namespace
}  // namespace meshsmooth::testing

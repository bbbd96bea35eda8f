// The published memory ceiling is a promise: every call at its limits at once, for a while.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/attach_call.hpp"
#include "server/row.hpp"
#include "server/smooth_call.hpp"
#include "support/http.hpp"
#include "support/http2_peer.hpp"
#include "support/sanitizer.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// MESHSMOOTH_CEILING_SECONDS.
std::chrono::seconds run_time() {
  const char* const seconds = std::getenv("MESHSMOOTH_CEILING_SECONDS");
  return std::chrono::seconds(seconds == nullptr ? 3 : std::stoi(seconds));
}

std::chrono::system_clock::time_point soon() { return std::chrono::system_clock::now() + 10s; }

std::int64_t resident_bytes(pid_t process) {
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  std::int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

v1::JobSpec spec_of(std::int64_t element_count) {
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->mutable_element_blocks(0)->set_element_count(element_count);
  return spec;
}

// --- what callers do, each once ------------------------------------------------------

// As many blocks as a mesh may have, a history, a result and a topology that are kept.
void run_kept_job(Stub& stub) {
  constexpr int kBlocks = 4096;
  static const Row row(2 * kBlocks);
  v1::JobSpec spec = row.spec(100'000);
  auto& blocks = *spec.mutable_inline_topology()->mutable_element_blocks();
  blocks.Clear();
  for (int i = 0; i < kBlocks; ++i) {
    v1::ElementBlock& block = *blocks.Add();
    block.set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    block.set_element_count(2);
  }
  spec.mutable_result_ttl()->set_seconds(600);
  spec.set_topology_kept(true);
  spec.set_iteration_history_included(true);
  SmoothCall call(stub, soon());
  call.send(spec);
  row.send(call);
  call.finish();
}

// Uploads that send half of their mesh and stop.
void stall_uploads(Stub& stub) {
  std::list<SmoothCall> calls;
  for (int i = 0; i < 20; ++i) {
    SmoothCall& call = calls.emplace_back(stub, std::chrono::system_clock::now() + 3s);
    call.send(spec_of(1 << 17));
  }
  for (SmoothCall& call : calls) {
    if (call.try_read_accepted()) {
      call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, std::string(1 << 20, '\0')));
    }
  }
}

// Messages of nearly the largest size that say nothing.
void send_large_messages(Stub& stub) {
  SmoothCall call(stub, soon());
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_request_id(std::string(4'000'000, 'x'));
  call.send(spec);
  call.finish();
  grpc::ClientContext context;
  v1::GetJobRequest request;
  request.set_name(std::string(4'000'000, 'x'));
  v1::GetJobResponse response;
  stub.GetJob(&context, request, &response);
}

void lease(Stub& stub) {
  grpc::ClientContext context;
  v1::LeaseSharedMemoryRequest request;
  request.set_size_bytes(1 << 20);
  v1::LeaseSharedMemoryResponse response;
  stub.LeaseSharedMemory(&context, request, &response);
}

// Streams of many jobs, running and ended, all open before one is read. Returns how many had a
// result.
int attach(Stub& stub) {
  grpc::ClientContext context;
  v1::ListJobsRequest request;
  request.set_page_size(60);
  for (const v1::State state : {v1::STATE_QUEUED, v1::STATE_RUNNING, v1::STATE_SUCCEEDED}) {
    request.add_states(state);  // not stalled uploads, which nobody would wait for
  }
  v1::ListJobsResponse response;
  if (!stub.ListJobs(&context, request, &response).ok()) return 0;
  std::list<AttachCall> calls;
  for (const v1::Job& job : response.jobs()) calls.emplace_back(stub, job.name());
  int results = 0;
  for (AttachCall& call : calls) results += call.finish().ok() && !call.result().empty() ? 1 : 0;
  return results;
}

// Answers that nobody reads: a client with a window of 0.
void leave_answers(int port) {
  const Peer peer(port);
  std::string calls;
  for (std::uint32_t i = 0; i < 120; ++i) {
    for (const char* const method : {"ListJobs", "GetServerInfo"}) {
      const std::uint32_t stream = 4 * i + (method[0] == 'L' ? 1 : 3);
      calls += frame(kHeaders, kEndHeaders, stream, call_headers(method)) +
               frame(kData, kEndStream, stream, message(""));
    }
  }
  peer.send(kPreface + frame(kSettings, 0, 0, big_endian(4, 2) + big_endian(0, 4)) +
            frame(kSettings, kAck, 0, "") + calls);
  static_cast<void>(peer.read_all());  // for 5 s: only frames without data
}

class Callers {
 public:
  explicit Callers(const ServerProgram& server) {
    for (int i = 0; i < 4; ++i) {
      for (const auto& step : {run_kept_job, stall_uploads, send_large_messages, lease}) {
        run([stub = std::make_shared<Stub>(server.connect()), step] { step(*stub); });
      }
      run([this, stub = std::make_shared<Stub>(server.connect())] { attached_ += attach(*stub); });
      run([port = server.port()] { leave_answers(port); });
    }
  }
  ~Callers() {
    stopped_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  Callers(const Callers&) = delete;
  Callers& operator=(const Callers&) = delete;

  [[nodiscard]] int rounds() const { return rounds_; }
  /// Results that were read again.
  [[nodiscard]] int attached() const { return attached_; }

 private:
  void run(const std::function<void()>& step) {
    threads_.emplace_back([this, step] {
      for (; !stopped_; ++rounds_) step();
    });
  }

  std::atomic<bool> stopped_ = false;
  std::atomic<int> rounds_ = 0, attached_ = 0;
  std::vector<std::thread> threads_;
};

TEST(MemoryCeiling, IsNotPassedByCallsAtTheirLimits) {
  ServerProgram server(0, {"--host-memory-limit-bytes", "256MiB", "--admin-listen", "127.0.0.1:0"});
  const auto ceiling =
      static_cast<std::int64_t>(parse_metrics(http_get(server.admin_port(), "/metrics").text)
                                    .at("meshsmooth_memory_ceiling_bytes"));
  std::int64_t peak = 0;
  {
    const Callers callers(server);
    const auto end = Clock::now() + run_time();
    ASSERT_TRUE(eventually(
        [&] {
          peak = std::max(peak, resident_bytes(server.process().id()));
          return Clock::now() >= end && callers.rounds() > 200 && callers.attached() > 10;
        },
        run_time() + 60s))
        << callers.rounds() << " rounds, " << callers.attached() << " results";
    std::printf("%d rounds, %d results read again; ", callers.rounds(), callers.attached());
  }
  std::printf("peak %ld of %ld MiB\n", static_cast<long>(peak >> 20),
              static_cast<long>(ceiling >> 20));
  EXPECT_TRUE(kAddressSanitizer || peak <= ceiling);
  EXPECT_EQ(http_get(server.admin_port(), "/readyz").status, 200);
}

}  // namespace
}  // namespace meshsmooth::testing

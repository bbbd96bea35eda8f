// R10: the program is told to leave while callers keep it busy.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <list>
#include <map>
#include <set>
#include <thread>

#include "server/row.hpp"
#include "server/smooth_call.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kLameDuckSeconds = 0.1;
constexpr double kGraceSeconds = 20;

int round_count() {
  const char* const count = std::getenv("MESHSMOOTH_DRAINS");
  return count == nullptr ? 5 : std::atoi(count);
}

std::vector<std::string> flags(double grace_seconds) {
  return {"--lame-duck-seconds", std::to_string(kLameDuckSeconds), "--drain-grace-seconds",
          std::to_string(grace_seconds), "--warm-up=false"};
}

/// What became of the jobs of one caller, who goes on until nobody answers.
class Caller {
 public:
  Caller(const ServerProgram& server, const Row& row)
      : stub_(server.connect()), row_(row), thread_([this] { run(); }) {}

  void join() { thread_.join(); }
  [[nodiscard]] int answered() const { return answered_; }
  /// How the others ended, with the number of each.
  [[nodiscard]] const std::map<std::string, int>& ends() const { return ends_; }
  [[nodiscard]] const std::set<std::string>& results() const { return results_; }

 private:
  void run() {
    for (bool gone = false; !gone;) {
      v1::JobSpec spec = row_.spec(20);
      spec.mutable_progress_interval()->set_nanos(1);
      SmoothCall call(stub_, std::chrono::system_clock::now() + 60s);
      call.send(spec);
      const auto first = call.read();
      const bool accepted = first && first->has_accepted();
      if (accepted) {
        row_.send(call);
      } else {
        call.half_close();
      }
      const grpc::Status& status = call.finish();
      if (status.ok()) {
        ++answered_;
        results_.insert(call.result());
        continue;
      }
      gone = !accepted && call.details().reason.empty();
      const bool ran =
          !call.progress().empty() && call.progress().back().state() > v1::STATE_QUEUED;
      ++ends_[std::string(ran        ? "running"
                          : accepted ? "accepted"
                                     : "not accepted") +
              ", " + (call.details().reason.empty() ? "lost" : call.details().reason)];
      if (!accepted && !gone) std::this_thread::sleep_for(5ms);
    }
  }

  Stub stub_;
  const Row& row_;
  int answered_ = 0;
  std::map<std::string, int> ends_;
  std::set<std::string> results_;
  std::thread thread_;
};

TEST(DrainUnderLoad, LosesNoJobThatItAccepted) {
  const Row row(3000);
  double longest = 0;
  int answered = 0;
  std::map<std::string, int> ends;
  std::set<std::string> results;
  for (int round = 0; round < round_count(); ++round) {
    ServerProgram server(0, flags(kGraceSeconds));
    {
      std::list<Caller> callers;
      for (int i = 0; i < 6; ++i) callers.emplace_back(server, row);
      std::this_thread::sleep_for(100ms + round % 10 * 13ms);

      const auto start = Clock::now();
      server.process().signal(SIGTERM);
      EXPECT_EQ(server.process().wait(), 0) << server.log();
      longest = std::max(longest, std::chrono::duration<double>(Clock::now() - start).count());
      for (Caller& caller : callers) {
        caller.join();
        answered += caller.answered();
        results.insert(caller.results().begin(), caller.results().end());
        for (const auto& [end, count] : caller.ends()) ends[end] += count;
      }
    }
  }

  std::cout << round_count() << " drains, " << answered << " jobs answered; the longest took "
            << longest << " s\n";
  for (const auto& [end, count] : ends) std::cout << count << " " << end << "\n";
  EXPECT_GT(answered, round_count());
  EXPECT_EQ(results.size(), 1U);  // all the same bits
  EXPECT_LE(longest, kLameDuckSeconds + kGraceSeconds + 2);
  // Those that waited are rejected as draining; callers that were not accepted were told so, or
  // found no server.
  std::set<std::string> seen;
  for (const auto& [end, count] : ends) seen.insert(end);
  for (const char* const allowed :
       {"accepted, DRAINING", "not accepted, DRAINING", "not accepted, lost"}) {
    seen.erase(allowed);
  }
  EXPECT_EQ(seen, std::set<std::string>());
}

TEST(DrainUnderLoad, ASecondSignalForcesTheShutdown) {
  ServerProgram server(0, flags(1000));
  const Row row(500'000);  // goes on for much longer than the grace
  Stub stub(server.connect());
  SmoothCall call(stub);
  call.send(row.spec(100'000'000));
  const std::string name = call.read_accepted();
  row.send(call);
  wait_for_state(stub, name, v1::STATE_RUNNING);
  server.process().signal(SIGTERM);
  ASSERT_TRUE(eventually([&] { return server.log().find("event=drain") != std::string::npos; }));
  // It waits for the job.
  std::this_thread::sleep_for(300ms);
  EXPECT_FALSE(server.process().ended());

  server.process().signal(SIGTERM);

  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(call.details().reason, "DRAINING");
  EXPECT_EQ(server.process().wait(), 0) << server.log();
}

TEST(DrainUnderLoad, AfterTheGraceItEndsAndSaysWhy) {
  ServerProgram server(0, flags(1));
  const Row row(500'000);  // goes on for much longer than the grace
  Stub stub(server.connect());
  SmoothCall call(stub);
  call.send(row.spec(100'000'000));
  const std::string name = call.read_accepted();
  row.send(call);
  wait_for_state(stub, name, v1::STATE_RUNNING);

  const auto start = Clock::now();
  server.process().signal(SIGTERM);
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(call.details().reason, "DRAINING");
  EXPECT_EQ(server.process().wait(), 0) << server.log();
  EXPECT_LE(Clock::now() - start, 1s + 100ms + 2s);
}

}  // namespace
}  // namespace meshsmooth::testing

#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <thread>

#include "server/smooth_call.hpp"

namespace meshsmooth::testing {

/// What a server must have back once its calls are over, whatever happened to them: jobs, bytes
/// and lanes, and the process its threads and descriptors. Make one before, `check` after.
class Conservation {
 public:
  explicit Conservation(Stub& stub) : stub_(stub), threads_(threads()), descriptors_(count("fd")) {}

  /// `kept_bytes`: of results and topologies that are still there on purpose. The limit ends a
  /// wait in vain.
  void check(std::int64_t kept_bytes = 0) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    const auto wait_for = [&](const auto& is_true) {
      while (!is_true() && std::chrono::steady_clock::now() < limit) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return is_true();
    };
    EXPECT_TRUE(wait_for([&] { return living_jobs() == 0; })) << living_jobs() << " jobs live";
    EXPECT_TRUE(wait_for([&] { return reserved_bytes() == kept_bytes; }))
        << reserved_bytes() << " bytes are reserved, " << kept_bytes << " should be";
    EXPECT_TRUE(wait_for([&] { return busy_lanes() == 0; })) << busy_lanes() << " lanes are busy";
    EXPECT_TRUE(wait_for([&] { return threads() <= threads_ + kSlack; }))
        << threads() << " threads, before there were " << threads_;
    EXPECT_TRUE(wait_for([&] { return count("fd") <= descriptors_ + kSlack; }))
        << count("fd") << " descriptors, before there were " << descriptors_;
  }

 private:
  // gRPC makes threads as it likes; a leak of one a call is more.
  static constexpr std::size_t kSlack = 8;

  static std::size_t count(const std::string& what) {
    const std::filesystem::directory_iterator entries("/proc/self/" + what);
    return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
  }
  static std::size_t threads() { return count("task"); }

  [[nodiscard]] int living_jobs() {
    v1::ListJobsRequest request;
    for (const v1::State state :
         {v1::STATE_RECEIVING, v1::STATE_QUEUED, v1::STATE_RUNNING, v1::STATE_SENDING}) {
      request.add_states(state);
    }
    return list_jobs(stub_, request).jobs_size();
  }
  [[nodiscard]] std::int64_t reserved_bytes() {
    return server_info(stub_).backends(0).reserved_bytes();
  }
  [[nodiscard]] int busy_lanes() { return server_info(stub_).backends(0).busy_lane_count(); }

  Stub& stub_;
  const std::size_t threads_, descriptors_;
};

}  // namespace meshsmooth::testing

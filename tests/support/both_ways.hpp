#pragma once

#include <gtest/gtest.h>

#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/server.hpp"
#include "support/in_process_server.hpp"
#include "support/process.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {

/// A server with the smoother of the CPU on a Unix socket; the tests run with chunks and with
/// shared memory, by INSTANTIATE_TEST_SUITE_P(Ways, Fixture, ::testing::Bool(), way_name).
class BothWays : public ::testing::TestWithParam<bool> {
 protected:
  BothWays() : server_(config()) { server_.start(); }

  [[nodiscard]] std::string target() const { return "unix:" + folder_.path("socket").string(); }
  [[nodiscard]] static client::RequestOptions request() {
    client::RequestOptions request;
    request.shared_memory = GetParam();
    return request;
  }
  /// Repeats a job until it goes the way that is tested: the first ones use chunks.
  /// @returns whether it did
  template <class Job>
  static bool goes_its_way(Job job) {
    return eventually([&] { return job().shared_memory == GetParam(); });
  }

 private:
  [[nodiscard]] server::ServerConfig config() const {
    server::ServerConfig config = quiet_config();
    config.listen = target();
    config.backend = "cpu";
    return config;
  }

  const ScratchFolder folder_;
  server::Server server_;
};

inline std::string way_name(const ::testing::TestParamInfo<bool>& shared) {
  return shared.param ? "SharedMemory" : "Chunks";
}

}  // namespace meshsmooth::testing

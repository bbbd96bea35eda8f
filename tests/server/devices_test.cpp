// Several devices in one server, each with lanes and memory of its own.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

class Devices : public ::testing::Test {
 protected:
  Devices() : server_(config(), kSpace) {
    server_.keeps_something();
    server_.fake().set_estimate({.host_bytes = 0, .device_bytes = 100});
  }

  static constexpr DeviceSpace kSpace{.total_bytes = 1 << 30, .free_bytes = 1 << 30};

  /// Two devices that give jobs 1000 bytes, one lane each.
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.devices = "0,1";
    config.device_bytes = 1000;
    return config;
  }

  /// A job that is there and has all its data.
  SmoothCall& send(const v1::JobSpec& spec = TwoTetrahedra::spec()) {
    calls_.push_back(std::make_unique<SmoothCall>(stub_));
    SmoothCall& call = *calls_.back();
    call.send(spec);
    name_ = call.read_accepted();
    if (spec.has_inline_topology()) {
      call.send_data(mesh_);
    } else {
      call.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh_.coordinates)));
    }
    call.half_close();
    return call;
  }
  /// The spec of further jobs on the mesh, whose topology is kept.
  v1::JobSpec keep() {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_topology_kept(true);
    SmoothCall& call = send(spec);
    v1::JobSpec named;
    named.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    while (const auto response = call.read()) {
      if (response->has_result()) named.set_topology_name(response->result().topology_name());
    }
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    calls_.clear();
    return named;
  }
  void wait_running() { wait_for_state(stub_, name_, v1::STATE_RUNNING); }
  void wait_queued() { wait_for_state(stub_, name_, v1::STATE_QUEUED); }
  /// A lane is busy until it has put its job away, which callers do not wait for.
  void expect_busy_lanes(const std::vector<int>& wanted) {
    std::vector<int> busy;
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    do {
      busy.clear();
      const auto info = server_info(stub_);
      for (const v1::Backend& backend : info.backends()) {
        EXPECT_EQ(backend.lane_count(), 1);
        busy.push_back(backend.busy_lane_count());
      }
    } while (busy != wanted && std::chrono::steady_clock::now() < limit);
    EXPECT_EQ(busy, wanted);
  }
  void finish_all() {
    server_.fake().release();
    for (const auto& call : calls_) {
      EXPECT_TRUE(call->finish().ok()) << call->finish().error_message();
      EXPECT_EQ(call->result(), mesh_.moved());
    }
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
  std::vector<std::unique_ptr<SmoothCall>> calls_;
  std::string name_;  // of the last job
};

TEST_F(Devices, ShareTheJobs) {
  server_.fake().hold();
  send();
  wait_running();
  expect_busy_lanes({1, 0});
  send();
  wait_running();
  expect_busy_lanes({1, 1});
  send();
  wait_queued();
  send();
  wait_queued();
  EXPECT_EQ(get_job(stub_, name_).queue_position(), 1) << "of its own device";
  finish_all();
}

TEST_F(Devices, RunAJobWhereItsTopologyIs) {
  server_.fake().set_prepared_bytes({.host_bytes = 0, .device_bytes = 500});
  const v1::JobSpec named = keep();
  EXPECT_EQ(server_.fake().prepared(), 1);

  server_.fake().hold();
  send();  // to the second, where less is promised
  wait_running();
  expect_busy_lanes({0, 1});
  send(named);
  wait_running();
  expect_busy_lanes({1, 1});
  EXPECT_EQ(server_.fake().prepared(), 1);
  finish_all();
}

TEST_F(Devices, PrepareATopologyEachForItself) {
  server_.fake().set_prepared_bytes({.host_bytes = 0, .device_bytes = 850});
  const v1::JobSpec named = keep();

  server_.fake().hold();
  send(named);  // takes the rest of the first
  wait_running();
  send(named);
  wait_running();
  expect_busy_lanes({1, 1});
  EXPECT_EQ(server_.fake().prepared(), 2);
  finish_all();
}

}  // namespace
}  // namespace meshsmooth::testing

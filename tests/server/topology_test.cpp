// Topologies that jobs name instead of sending.
#include <gtest/gtest.h>

#include <thread>

#include "server/smooth_call.hpp"
#include "support/http.hpp"
#include "support/in_process_server.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;

class Topologies : public ::testing::Test {
 protected:
  explicit Topologies(server::ServerConfig config = quiet_config()) : server_(std::move(config)) {
    server_.keeps_something();
  }

  static v1::JobSpec kept_spec() {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_topology_kept(true);
    return spec;
  }
  static v1::JobSpec named_spec(const std::string& name) {
    v1::JobSpec spec;
    spec.set_topology_name(name);
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    return spec;
  }

  /// Sends the mesh and has it kept; its name, from the result's header.
  std::string keep(const TwoTetrahedra& mesh, bool first_node_fixed = false) {
    TwoTetrahedra sent = mesh;
    sent.fixed[0] = first_node_fixed ? 1 : 0;
    SmoothCall call(stub_);
    call.send_all(sent, kept_spec());
    call.read_accepted();
    std::string name;
    for (auto response = call.read(); response; response = call.read()) {
      if (response->has_result()) name = response->result().topology_name();
      if (response->has_summary()) break;
    }
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    return name;
  }

  void send_coordinates(SmoothCall& call) {
    call.send(chunk(v1::ARRAY_ID_COORDINATES, 0, bytes_of(mesh_.coordinates)));
    call.half_close();
  }

  grpc::Status get_topology(const std::string& name, v1::Topology& topology) {
    grpc::ClientContext context;
    v1::GetTopologyRequest request;
    request.set_name(name);
    v1::GetTopologyResponse response;
    const grpc::Status status = stub_.GetTopology(&context, request, &response);
    topology = response.topology();
    return status;
  }
  bool is_kept(const std::string& name) {
    v1::Topology topology;
    return get_topology(name, topology).ok();
  }
  grpc::Status delete_topology(const std::string& name) {
    grpc::ClientContext context;
    v1::DeleteTopologyRequest request;
    request.set_name(name);
    v1::DeleteTopologyResponse response;
    return stub_.DeleteTopology(&context, request, &response);
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
};

TEST_F(Topologies, AreNamedByTheirContent) {
  const std::string name = keep(mesh_);

  // The bytes as the proto says, hashed by another program (Python's hashlib).
  EXPECT_EQ(name,
            "topologies/sha256-"
            "54a1b1df6e1f1dde0d2144a0ca570cf18c1ae15e6bc5f491e5ce0ea66d33f7ce");
  const std::vector<NodeId> nodes = {0, 1, 2, 3, 1, 2, 3, 4};
  const std::vector<std::uint8_t> fixed = {0, 1, 0, 0, 0};
  const std::vector<ElementBlockView> blocks = {{ElementType::tetrahedron, nodes}};
  EXPECT_EQ(wire::topology_name({.node_count = 5, .blocks = blocks, .fixed = fixed}), name);
}

TEST_F(Topologies, ServeJobsThatSendCoordinatesOnly) {
  const std::string name = keep(mesh_);
  for (int i = 0; i < 2; ++i) {
    SmoothCall call(stub_);
    call.send(named_spec(name));
    send_coordinates(call);
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    EXPECT_EQ(call.result(), mesh_.moved());  // so the fixed node was known
    EXPECT_TRUE(call.summary()->execution().topology_reused());
  }
}

TEST_F(Topologies, ServeBothPrecisions) {
  const std::string name = keep(mesh_);
  v1::JobSpec spec = named_spec(name);
  spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT32);
  SmoothCall call(stub_);
  call.send(spec);
  call.send(
      chunk(v1::ARRAY_ID_COORDINATES, 0,
            bytes_of(std::vector<float>(mesh_.coordinates.begin(), mesh_.coordinates.end()))));
  call.half_close();

  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result().size(), 60U);
}

TEST_F(Topologies, TakeNothingButCoordinates) {
  const std::string name = keep(mesh_);
  SmoothCall call(stub_);
  call.send(named_spec(name));
  call.read_accepted();
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.elements));

  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.details().reason, "CHUNK_OUT_OF_ORDER");
}

TEST_F(Topologies, AreNotKeptUnlessAsked) {
  SmoothCall call(stub_);
  call.send_all(mesh_);
  EXPECT_TRUE(call.finish().ok());
  const std::string name = keep(mesh_);
  EXPECT_TRUE(delete_topology(name).ok());

  SmoothCall named(stub_);
  named.send(named_spec(name));
  EXPECT_EQ(named.finish().error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(named.details().reason, "TOPOLOGY_NOT_FOUND");
  EXPECT_TRUE(named.was_told_to_stop());
  EXPECT_EQ(delete_topology(name).error_code(), StatusCode::NOT_FOUND);
  expect_nothing_reserved(stub_);
}

TEST_F(Topologies, SayWhatTheyAre) {
  v1::Topology topology;
  ASSERT_TRUE(get_topology(keep(mesh_), topology).ok());

  EXPECT_EQ(topology.spec().node_count(), 5);
  EXPECT_TRUE(topology.spec().fixed_mask_present());
  EXPECT_EQ(topology.spec().element_blocks(0).element_count(), 2);
  EXPECT_GE(topology.resident_bytes(), 37);
}

TEST_F(Topologies, AreOneForAllWhoSendTheSame) {
  const std::string name = keep(mesh_);
  EXPECT_EQ(keep(mesh_), name);
  EXPECT_NE(keep(mesh_, true), name);
  EXPECT_EQ(server_.fake().prepared(), 2);
}

TEST_F(Topologies, OutliveTheirDeletionInAJobThatRuns) {
  const std::string name = keep(mesh_);
  server_.fake().hold();
  SmoothCall call(stub_);
  call.send(named_spec(name));
  send_coordinates(call);
  server_.fake().wait_started(2);

  EXPECT_TRUE(delete_topology(name).ok());
  server_.fake().release();

  EXPECT_TRUE(call.finish().ok());
  EXPECT_EQ(call.result(), mesh_.moved());
  expect_nothing_reserved(stub_);
}

TEST_F(Topologies, ThatAreWrongAreNotKeptPrepared) {
  server_.fake().fail_to_prepare([] {
    throw InvalidMesh("FACET_OVERUSED", "why", {{"element", "1"}});
  });
  for (int i = 0; i < 2; ++i) {
    SmoothCall call(stub_);
    call.send_all(mesh_, kept_spec());
    EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(call.details().reason, "FACET_OVERUSED");
  }
  EXPECT_EQ(server_.fake().prepared(), 2);
}

class TwoLanes : public Topologies {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.lanes = 2;
    return config;
  }
  TwoLanes() : Topologies(config()) {}
};

TEST_F(TwoLanes, PrepareATopologyOnce) {
  server_.fake().hold_preparation();
  SmoothCall first(stub_), second(stub_);
  first.send_all(mesh_, kept_spec());
  second.send_all(mesh_, kept_spec());
  for (SmoothCall* call : {&first, &second}) {
    wait_for_state(stub_, call->read_accepted(), v1::STATE_RUNNING);
  }
  server_.fake().release();

  EXPECT_TRUE(first.finish().ok());
  EXPECT_TRUE(second.finish().ok());
  EXPECT_EQ(server_.fake().prepared(), 1);
  EXPECT_NE(first.summary()->execution().topology_reused(),
            second.summary()->execution().topology_reused());
}

TEST_F(TwoLanes, LetAJobGoThatWaitsForAnothersPreparation) {
  server_.fake().hold_preparation();
  SmoothCall first(stub_), second(stub_);
  first.send_all(mesh_, kept_spec());
  wait_for_state(stub_, first.read_accepted(), v1::STATE_RUNNING);
  second.send_all(mesh_, kept_spec());
  const std::string name = second.read_accepted();
  wait_for_state(stub_, name, v1::STATE_RUNNING);

  second.cancel();

  wait_for_state(stub_, name, v1::STATE_CANCELLED);
  server_.fake().release();
  EXPECT_TRUE(first.finish().ok());
}

class LittleMemory : public Topologies {
 protected:
  static server::ServerConfig config(std::int64_t topology_bytes) {
    server::ServerConfig config = quiet_config();
    config.max_topology_bytes = topology_bytes;
    config.admin_listen = "127.0.0.1:0";
    return config;
  }
  LittleMemory() : Topologies(config(80)) {}  // two of 37 bytes
};

TEST_F(LittleMemory, IsCountedForPrometheus) {
  const auto count = [&](const std::string& what) {
    const int port = server_.server().admin_port();
    return parse_metrics(http_get(port, "/metrics").text).at("meshsmooth_topology_cache_" + what);
  };
  const std::string first = keep(mesh_);
  for (int i = 0; i < 3; ++i) {
    SmoothCall call(stub_);
    call.send(named_spec(first));
    send_coordinates(call);
    EXPECT_TRUE(call.finish().ok());
  }
  EXPECT_TRUE(is_kept(first));  // which is no job's doing
  SmoothCall call(stub_);
  call.send(named_spec("topologies/sha256-0"));
  EXPECT_EQ(call.finish().error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(count("entries"), 1);
  EXPECT_EQ(count("bytes"), 37);
  EXPECT_EQ(count("evictions_total"), 0);
  keep(mesh_, true);

  TwoTetrahedra other = mesh_;
  other.elements = bytes_of<std::int32_t>({0, 1, 2, 3, 2, 1, 3, 4});
  keep(other);

  EXPECT_EQ(count("hits_total"), 3);
  EXPECT_EQ(count("misses_total"), 1);
  EXPECT_EQ(count("evictions_total"), 1);
  EXPECT_EQ(count("entries"), 2);
  EXPECT_EQ(count("bytes"), 74);
}

TEST_F(LittleMemory, GivesUpTheLeastRecentlyUsed) {
  TwoTetrahedra other = mesh_;
  other.elements = bytes_of<std::int32_t>({0, 1, 2, 3, 2, 1, 3, 4});
  const std::string first = keep(mesh_);
  const std::string second = keep(other);
  EXPECT_TRUE(is_kept(first));  // and so the one used last
  const std::string third = keep(mesh_, true);

  EXPECT_TRUE(is_kept(first));
  EXPECT_FALSE(is_kept(second));
  EXPECT_TRUE(is_kept(third));
}

class FullMemory : public Topologies {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.host_memory_limit_bytes = config.max_job_bytes = 40 << 20;
    config.stream_window_bytes = 1 << 20;
    return config;
  }
  FullMemory() : Topologies(config()) {}
};

TEST_F(FullMemory, GivesTopologiesUpBeforeItRefusesAJob) {
  const std::string name = keep(mesh_);
  while (server_info(stub_).backends(0).reserved_bytes() > 37) std::this_thread::yield();
  // A job that needs all the rest.
  const std::int64_t limit = server_info(stub_).backends(0).total_bytes();
  v1::JobSpec check = TwoTetrahedra::spec();
  check.set_validate_only(true);
  SmoothCall small(stub_);
  small.send(check);
  const auto accepted = small.read();
  ASSERT_TRUE(accepted && accepted->has_accepted());
  server_.fake().set_estimate(
      {.host_bytes = limit - accepted->accepted().host_reserved_bytes(), .device_bytes = 0});
  EXPECT_TRUE(is_kept(name));

  SmoothCall call(stub_);
  call.send_all(mesh_);

  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_FALSE(is_kept(name));
}

}  // namespace
}  // namespace meshsmooth::testing

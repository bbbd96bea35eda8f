// The server's process is killed in every state of a job, and started again.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "server/server_program.hpp"
#include "server/smooth_call.hpp"

namespace meshsmooth::testing {
namespace {

/// A row of tetrahedra, as many as make a job take its time.
struct Row {
  static constexpr std::int64_t kElements = 400'000;
  static constexpr std::int64_t kNodes = kElements + 3;

  static v1::JobSpec spec(int sweeps, const char* id) {
    v1::JobSpec spec;
    spec.set_request_id(id);
    v1::TopologySpec* topology = spec.mutable_inline_topology();
    topology->set_node_count(kNodes);
    topology->add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    topology->mutable_element_blocks(0)->set_element_count(kElements);
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    v1::SmoothingOptions* options = spec.mutable_options();
    options->mutable_laplacian()->set_relaxation_factor(1e-6);
    options->set_guard(false);
    options->set_boundary_policy(v1::BOUNDARY_POLICY_FREE);
    options->set_max_iteration_count(sweeps);
    options->set_absolute_tolerance(1e-300);
    return spec;
  }
  static void send(SmoothCall& call) {
    std::vector<std::int32_t> elements;
    std::vector<double> places;
    for (std::int32_t e = 0; e < kElements; ++e) {
      for (const std::int32_t n : {0, 1, 2, 3}) elements.push_back(e + n);
      // Every second one would lie the other way round.
      if (e % 2 == 1) std::swap(elements[elements.size() - 1], elements[elements.size() - 2]);
    }
    for (std::int64_t n = 0; n < kNodes; ++n) {
      const double a = 2.0 * static_cast<double>(n);
      for (const double x : {std::cos(a), std::sin(a), 0.2 * static_cast<double>(n)}) {
        places.push_back(x);
      }
    }
    send_array(call, v1::ARRAY_ID_ELEMENTS, bytes_of(elements));
    send_array(call, v1::ARRAY_ID_COORDINATES, bytes_of(places));
    call.half_close();
  }
  static void send_array(SmoothCall& call, v1::ArrayId id, const std::string& bytes) {
    constexpr std::size_t kChunk = 1 << 20;
    for (std::size_t at = 0; at < bytes.size(); at += kChunk) {
      if (!call.send(chunk(id, static_cast<std::int64_t>(at), bytes.substr(at, kChunk)))) return;
    }
  }
};

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";
constexpr const char* kOtherId = "11234567-89ab-cdef-0123-456789abcdef";
constexpr int kForEver = 100'000'000;

class Kill : public ::testing::TestWithParam<v1::State> {};

TEST_P(Kill, TellsTheClientAndTheSameRequestSucceedsLater) {
  const v1::State state = GetParam();
  std::optional<ServerProgram> server(std::in_place);
  {
    Stub stub = server->connect();
    SmoothCall first(stub), call(stub);
    if (state == v1::STATE_QUEUED) {
      first.send(Row::spec(kForEver, kOtherId));
      const std::string name = first.read_accepted();
      Row::send(first);
      wait_for_state(stub, name, v1::STATE_RUNNING);
    }
    call.send(Row::spec(state == v1::STATE_SENDING ? 1 : kForEver, kId));
    const std::string name = call.read_accepted();
    if (state != v1::STATE_RECEIVING) Row::send(call);
    wait_for_state(stub, name, state);

    server->kill();

    EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE)
        << call.finish().error_message();
  }
  const int port = server->port();
  server.reset();
  ServerProgram again(port);
  Stub stub = again.connect();
  SmoothCall call(stub);
  call.send(Row::spec(1, kId));
  Row::send(call);
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result().size(), 24U * Row::kNodes);
}

std::string state_name(const ::testing::TestParamInfo<v1::State>& info) {
  return v1::State_Name(info.param).substr(sizeof "STATE");
}

INSTANTIATE_TEST_SUITE_P(States, Kill,
                         ::testing::Values(v1::STATE_RECEIVING, v1::STATE_QUEUED, v1::STATE_RUNNING,
                                           v1::STATE_SENDING),
                         state_name);

}  // namespace
}  // namespace meshsmooth::testing

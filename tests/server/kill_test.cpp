// The server's process is killed in every state of a job, and started again.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "server/row.hpp"
#include "server/smooth_call.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";
constexpr const char* kOtherId = "11234567-89ab-cdef-0123-456789abcdef";
constexpr int kForEver = 100'000'000;

class Kill : public ::testing::TestWithParam<v1::State> {};

TEST_P(Kill, TellsTheClientAndTheSameRequestSucceedsLater) {
  const v1::State state = GetParam();
  const Row row(400'000);
  std::optional<ServerProgram> server(std::in_place);
  {
    Stub stub(server->connect());
    SmoothCall first(stub), call(stub);
    if (state == v1::STATE_QUEUED) {
      first.send(row.spec(kForEver, kOtherId));
      const std::string name = first.read_accepted();
      row.send(first);
      wait_for_state(stub, name, v1::STATE_RUNNING);
    }
    call.send(row.spec(state == v1::STATE_SENDING ? 1 : kForEver, kId));
    const std::string name = call.read_accepted();
    if (state != v1::STATE_RECEIVING) row.send(call);
    wait_for_state(stub, name, state);

    server->kill();

    EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE)
        << call.finish().error_message();
  }
  const int port = server->port();
  server.reset();
  ServerProgram again(port);
  Stub stub(again.connect());
  SmoothCall call(stub);
  call.send(row.spec(1, kId));
  row.send(call);
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.result().size(), row.result_bytes());
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

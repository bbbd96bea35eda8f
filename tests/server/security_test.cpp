// Who may do what: tokens, jobs of others, quotas, and what metadata may be.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "server/attach_call.hpp"
#include "server/smooth_call.hpp"
#include "support/certificates.hpp"
#include "support/http.hpp"
#include "support/in_process_server.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;

constexpr const char* kTraceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

Metadata token(const std::string& text) { return {{"authorization", "Bearer " + text}}; }

/// Asks for a job by each call that can; the code that all of them gave.
StatusCode ask_for_job(Stub& stub, const std::string& name, const Metadata& metadata) {
  const auto ask = [&](auto request, auto response, const auto& call) {
    grpc::ClientContext context;
    for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
    request.set_name(name);
    return call(&context, request, &response).error_code();
  };
  const StatusCode get = ask(v1::GetJobRequest(), v1::GetJobResponse(),
                             [&](auto... arguments) { return stub.GetJob(arguments...); });
  const StatusCode cancel = ask(v1::CancelJobRequest(), v1::CancelJobResponse(),
                                [&](auto... arguments) { return stub.CancelJob(arguments...); });
  const StatusCode remove = ask(v1::DeleteJobRequest(), v1::DeleteJobResponse(),
                                [&](auto... arguments) { return stub.DeleteJob(arguments...); });
  const StatusCode attach =
      ask(v1::AttachJobRequest(), v1::AttachJobResponse(),
          [&](grpc::ClientContext* context, const v1::AttachJobRequest& request,
              v1::AttachJobResponse* response) {
            const auto reader = stub.AttachJob(context, request);
            while (reader->Read(response)) {
            }
            return reader->Finish();
          });
  EXPECT_EQ(cancel, get);
  EXPECT_EQ(remove, get);
  EXPECT_EQ(attach, get);
  return get;
}

std::size_t job_count(Stub& stub, const Metadata& metadata) {
  grpc::ClientContext context;
  for (const auto& [key, value] : metadata) context.AddMetadata(key, value);
  v1::ListJobsResponse response;
  EXPECT_TRUE(stub.ListJobs(&context, {}, &response).ok());
  return static_cast<std::size_t>(response.jobs_size());
}

class Tokens : public ::testing::Test {
 protected:
  Tokens() {
    write(
        "# who: token\nalice:abc\n"
        "bob:sha256:88d4266fd4e6338d13b845fcf289579d209c897823b9217da3e161936f031589\n");  // abcd
    config_.token_file = files_.path("tokens");
    config_.credentials_reload_interval = std::chrono::seconds(0);
  }
  void write(const std::string& text) { files_.write("tokens", text); }
  void start() {
    server_ = std::make_unique<InProcessServer>(config_);
    stub_ = std::make_unique<Stub>(server_->channel());
  }
  grpc::Status smooth(const Metadata& metadata) {
    SmoothCall call(*stub_, {}, metadata);
    call.send_all({});
    const grpc::Status status = call.finish();
    reason_ = call.details().reason;
    return status;
  }

  const ScratchFolder files_;
  server::ServerConfig config_ = quiet_config();
  std::unique_ptr<InProcessServer> server_;
  std::unique_ptr<Stub> stub_;
  std::string reason_;
};

TEST_F(Tokens, OpenTheDoorToThoseWhoHaveOne) {
  start();
  EXPECT_TRUE(smooth(token("abc")).ok());
  EXPECT_TRUE(smooth(token("abcd")).ok());
  EXPECT_EQ(job_count(*stub_, token("abc")), 1);
}

TEST_F(Tokens, KeepTheOthersOut) {
  config_.admin_listen = "127.0.0.1:0";
  start();
  EXPECT_EQ(smooth({}).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(reason_, "TOKEN_MISSING");
  for (const char* wrong : {"ab", "abcde", "ABC", "", "alice", "alice:abc",
                            "88d4266fd4e6338d13b845fcf289579d209c897823b9217da3e161936f031589"}) {
    EXPECT_EQ(smooth(token(wrong)).error_code(), StatusCode::UNAUTHENTICATED) << wrong;
    EXPECT_EQ(reason_, "TOKEN_UNKNOWN") << wrong;
  }
  EXPECT_EQ(smooth({{"authorization", "Basic abc"}}).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(smooth({{"authorization", "Bearer abc"}, {"authorization", "Bearer abc"}}).error_code(),
            StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ask_for_job(*stub_, "jobs/any", {}), StatusCode::UNAUTHENTICATED);
  grpc::ClientContext context;
  v1::GetServerInfoResponse info;
  EXPECT_EQ(stub_->GetServerInfo(&context, {}, &info).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(info.ByteSizeLong(), 0);

  EXPECT_EQ(server_->fake().started(), 0);
  const auto metrics = parse_metrics(http_get(server_->server().admin_port(), "/metrics").text);
  EXPECT_EQ(metrics.at("meshsmooth_denied_calls_total{reason=\"TOKEN_UNKNOWN\"}"), 7);
  EXPECT_EQ(metrics.at("meshsmooth_jobs_total{outcome=\"refused\",reason=\"TOKEN_UNKNOWN\"}"), 7);
}

TEST_F(Tokens, AreReadAgainWhenTheFileChanges) {
  start();
  EXPECT_TRUE(smooth(token("abc")).ok());
  write("alice:new\n");
  EXPECT_FALSE(smooth(token("abc")).ok());
  EXPECT_TRUE(smooth(token("new")).ok());
  write("what is this\n");  // the tokens before count on
  EXPECT_TRUE(smooth(token("new")).ok());
  write("alice:newer\n");
  EXPECT_TRUE(smooth(token("newer")).ok());
}

TEST_F(Tokens, ThatAreWrittenWronglyEndTheStart) {
  for (const char* wrong :
       {"", "# nobody\n", "alice\n", ":abc\n", "alice:\n", "alice:a b\n", "alice:sha256:12\n",
        "a:b\nalice:sha256:"
        "zzd4266fd4e6338d13b845fcf289579d209c897823b9217da3e161936f031589\n"}) {
    write(wrong);
    try {
      start();
      ADD_FAILURE() << wrong;
    } catch (const InvalidOption& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("token-file")) << wrong;
      EXPECT_THAT(error.what(), ::testing::Not(::testing::HasSubstr("a b"))) << wrong;
    }
  }
}

TEST_F(Tokens, KeepTheJobsOfDifferentCallersApart) {
  start();
  server_->fake().hold();
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.set_request_id("6f1b2d3c-0000-4000-8000-000000000001");
  SmoothCall mine(*stub_, {}, token("abc"));
  mine.send_all({}, spec);
  const std::string name = mine.read_accepted();
  server_->fake().wait_started(1);

  EXPECT_EQ(ask_for_job(*stub_, name, token("abcd")), StatusCode::NOT_FOUND);
  EXPECT_EQ(job_count(*stub_, token("abcd")), 0);
  EXPECT_EQ(job_count(*stub_, token("abc")), 1);

  SmoothCall same_id(*stub_, {}, token("abcd"));  // no key to another's job
  same_id.send_all({}, spec);
  EXPECT_NE(same_id.read_accepted(), name);
  server_->fake().release();
  EXPECT_TRUE(same_id.finish().ok());
  EXPECT_TRUE(mine.finish().ok());
  EXPECT_EQ(ask_for_job(*stub_, name, token("abcd")), StatusCode::NOT_FOUND);
}

TEST_F(Tokens, HaveTheirQuotaOfJobs) {
  config_.max_jobs_per_caller = 2;
  start();
  server_->fake().hold();
  SmoothCall first(*stub_, {}, token("abc")), second(*stub_, {}, token("abc"));
  for (SmoothCall* call : {&first, &second}) {
    call->send_all({});
    call->read_accepted();
  }

  SmoothCall third(*stub_, {}, token("abc"));
  third.send(TwoTetrahedra::spec());
  EXPECT_EQ(third.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(third.details().reason, "QUOTA_EXCEEDED");
  EXPECT_EQ(third.detail("limit_jobs"), "2");
  EXPECT_TRUE(third.details().retry_delay);

  SmoothCall other(*stub_, {}, token("abcd"));
  other.send_all({});
  server_->fake().release();
  EXPECT_TRUE(other.finish().ok());
  EXPECT_TRUE(first.finish().ok());
  EXPECT_TRUE(second.finish().ok());
  EXPECT_TRUE(smooth(token("abc")).ok());
}

TEST_F(Tokens, HaveTheirQuotaOfBytes) {
  const MemoryEstimate need{.host_bytes = 1 << 20, .device_bytes = 0};
  config_.max_bytes_per_caller = 3 << 19;
  start();
  server_->fake().set_estimate(need);
  server_->fake().hold();
  SmoothCall first(*stub_, {}, token("abc"));
  first.send_all({});
  first.read_accepted();
  SmoothCall second(*stub_, {}, token("abc"));
  second.send(TwoTetrahedra::spec());
  EXPECT_EQ(second.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(second.details().reason, "QUOTA_EXCEEDED");
  EXPECT_EQ(second.detail("limit_bytes"), std::to_string(3 << 19));
  server_->fake().release();
  EXPECT_TRUE(first.finish().ok());
  EXPECT_TRUE(smooth(token("abc")).ok());
}

TEST_F(Tokens, HaveNoQuotaForWhatNeverFits) {
  config_.max_bytes_per_caller = 1 << 19;
  start();
  server_->fake().set_estimate({.host_bytes = 1 << 20, .device_bytes = 0});
  EXPECT_EQ(smooth(token("abc")).error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(reason_, "MESH_TOO_LARGE");
}

TEST(Metadata, OfATraceIsEchoedWhenItIsOne) {
  InProcessServer server;
  Stub stub(server.channel());
  const auto echo = [&](const std::string& text) {
    SmoothCall call(stub, {}, {{"traceparent", text}});
    call.send_all({});
    EXPECT_TRUE(call.finish().ok());
    return call.initial_metadata("traceparent");
  };
  EXPECT_EQ(echo(kTraceparent), kTraceparent);
  EXPECT_EQ(echo("cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-what-comes"),
            "cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-what-comes");
  EXPECT_EQ(echo("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7"), "");
  EXPECT_EQ(echo("00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01"), "");

  grpc::ClientContext context;
  context.AddMetadata("traceparent", kTraceparent);
  v1::GetServerInfoResponse info;
  EXPECT_TRUE(stub.GetServerInfo(&context, {}, &info).ok());
  EXPECT_EQ(context.GetServerInitialMetadata().count("traceparent"), 1);
}

TEST(Metadata, IsBounded) {
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  InProcessServer server(config);
  Stub stub(grpc::CreateChannel("127.0.0.1:" + std::to_string(server.server().port()),
                                grpc::InsecureChannelCredentials()));
  const auto ask_with = [&](std::size_t bytes) {
    grpc::ClientContext context;
    context.AddMetadata("x-much", std::string(bytes, 'x'));
    v1::GetServerInfoResponse info;
    return stub.GetServerInfo(&context, {}, &info).error_code();
  };
  EXPECT_EQ(ask_with(4000), StatusCode::OK);
  EXPECT_EQ(ask_with(9000), StatusCode::RESOURCE_EXHAUSTED);
  // gRPC may close that connection before or after it has said why; the server goes on.
  EXPECT_THAT(ask_with(1 << 20),
              ::testing::AnyOf(StatusCode::RESOURCE_EXHAUSTED, StatusCode::UNAVAILABLE));
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  StatusCode code = StatusCode::UNAVAILABLE;
  while (code != StatusCode::OK && std::chrono::steady_clock::now() < end) code = ask_with(100);
  EXPECT_EQ(code, StatusCode::OK);
}

}  // namespace
}  // namespace meshsmooth::testing

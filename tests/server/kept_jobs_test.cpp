// Jobs that several calls share, and results that outlive their calls.
#include <google/protobuf/util/time_util.h>
#include <gtest/gtest.h>

#include "server/attach_call.hpp"
#include "server/smooth_call.hpp"
#include "support/growing_time.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using namespace std::chrono_literals;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";
constexpr const char* kOtherId = "11234567-89ab-cdef-0123-456789abcdef";

class SharedJobs : public ::testing::Test {
 protected:
  explicit SharedJobs(server::ServerConfig config = quiet_config()) : server_(std::move(config)) {
    server_.keeps_something();
  }

  static v1::JobSpec spec(const std::string& id = kId) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_request_id(id);
    return spec;
  }
  static v1::JobSpec kept_spec(const std::string& id = kId, std::int64_t seconds = 3600) {
    v1::JobSpec spec = SharedJobs::spec(id);
    spec.mutable_result_ttl()->set_seconds(seconds);
    return spec;
  }

  std::string run(SmoothCall& call, const v1::JobSpec& spec) {
    call.send_all(mesh_, spec);
    const std::string name = call.read_accepted();
    wait_for_state(stub_, name, v1::STATE_RUNNING);
    return name;
  }

  // A call that joins: its job's name, once it knows that it need not send.
  std::string join(SmoothCall& call, const v1::JobSpec& spec) {
    call.send(spec);
    const std::string name = call.read_accepted();
    const auto next = call.read();
    EXPECT_TRUE(next && next->has_stop_sending());
    call.half_close();
    return name;
  }

  // A kept job that has succeeded, without a call.
  std::string keep(const std::string& id = kId, std::int64_t seconds = 3600) {
    SmoothCall call(stub_);
    call.send_all(mesh_, kept_spec(id, seconds));
    const std::string name = call.read_accepted();
    EXPECT_TRUE(call.finish().ok());
    return name;
  }

  grpc::Status delete_job(const std::string& name) {
    grpc::ClientContext context;
    v1::DeleteJobRequest request;
    request.set_name(name);
    v1::DeleteJobResponse response;
    return stub_.DeleteJob(&context, request, &response);
  }
  grpc::Status cancel_job(const std::string& name, bool result_kept) {
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_name(name);
    request.set_result_kept(result_kept);
    v1::CancelJobResponse response;
    return stub_.CancelJob(&context, request, &response);
  }
  static std::string reason(const grpc::Status& status) {
    return wire::decode_status_details(status.error_details())
        .value_or(wire::StatusDetails{})
        .reason;
  }

  InProcessServer server_;
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;
};

TEST_F(SharedJobs, AreJoinedByTheSameRequest) {
  server_.fake().hold();
  SmoothCall first(stub_), second(stub_);
  const std::string name = run(first, spec());

  EXPECT_EQ(join(second, spec()), name);

  server_.fake().release();
  EXPECT_TRUE(first.finish().ok());
  EXPECT_TRUE(second.finish().ok()) << second.finish().error_message();
  EXPECT_EQ(first.result(), mesh_.moved());
  EXPECT_EQ(second.result(), mesh_.moved());
  EXPECT_TRUE(second.summary());
  EXPECT_EQ(server_.fake().started(), 1);
  expect_nothing_reserved(stub_);
}

TEST_F(SharedJobs, AreNotJoinedByAnotherRequest) {
  server_.fake().hold();
  SmoothCall first(stub_), second(stub_), third(stub_);
  run(first, spec());
  v1::JobSpec other = spec();
  other.mutable_options()->mutable_laplacian();

  second.send(other);
  EXPECT_EQ(second.finish().error_code(), StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(second.details().reason, "REQUEST_ID_REUSED");
  EXPECT_EQ(second.detail("field"), "options");

  // How a call wants to be told is no part of the job.
  v1::JobSpec same = spec();
  same.mutable_progress_interval()->set_seconds(1);
  same.set_max_result_chunk_bytes(4096);
  join(third, same);
  server_.fake().release();
  EXPECT_TRUE(third.finish().ok());
}

TEST_F(SharedJobs, GoOnWhenOneOfTheirCallsLeaves) {
  server_.fake().hold();
  SmoothCall first(stub_), second(stub_);
  const std::string name = run(first, spec());
  join(second, spec());

  first.cancel();
  first.finish();
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(get_job(stub_, name).state(), v1::STATE_RUNNING);

  server_.fake().release();
  EXPECT_TRUE(second.finish().ok());
  EXPECT_EQ(second.result(), mesh_.moved());
}

TEST_F(SharedJobs, EndWhenTheLastCallLeaves) {
  server_.fake().hold();
  SmoothCall first(stub_), second(stub_);
  const std::string name = run(first, spec());
  join(second, spec());

  first.cancel();
  second.cancel();

  EXPECT_EQ(wait_for_state(stub_, name, v1::STATE_CANCELLED).error().reason(),
            "CANCELLED_BY_CLIENT");
  expect_nothing_reserved(stub_);
}

TEST_F(SharedJobs, TellTheOthersWhenTheUploadIsLost) {
  SmoothCall first(stub_), second(stub_), third(stub_);
  first.send(spec());
  first.read_accepted();
  join(second, spec());

  first.cancel();

  EXPECT_EQ(second.finish().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(second.details().reason, "UPLOAD_LOST");
  EXPECT_EQ(second.details().retry_delay, 0ns);
  third.send_all(mesh_, spec());  // brings the mesh itself
  EXPECT_TRUE(third.finish().ok());
  EXPECT_EQ(third.result(), mesh_.moved());
}

TEST_F(SharedJobs, RunAgainWhenTheirResultIsNotKept) {
  for (int i = 1; i <= 2; ++i) {
    SmoothCall call(stub_);
    call.send_all(mesh_, spec());
    EXPECT_TRUE(call.finish().ok());
    EXPECT_EQ(server_.fake().started(), i);
  }
}

// --- kept results -----------------------------------------------------------------

TEST_F(SharedJobs, OutliveTheirCallWhenAsked) {
  server_.fake().hold();
  std::string name;
  {
    SmoothCall call(stub_);
    name = run(call, kept_spec());
    call.cancel();
    call.finish();
  }
  server_.fake().release();

  const v1::Job job = wait_for_state(stub_, name, v1::STATE_SUCCEEDED);
  EXPECT_EQ(job.expire_time(),
            job.end_time() + google::protobuf::util::TimeUtil::SecondsToDuration(3600));
  AttachCall attach(stub_, name);
  EXPECT_TRUE(attach.finish().ok()) << attach.finish().error_message();
  EXPECT_EQ(attach.result(), mesh_.moved());
  EXPECT_TRUE(attach.summary());
}

TEST_F(SharedJobs, OutliveTheDeadlineOfTheirCall) {
  server_.fake().hold();
  SmoothCall first(stub_);
  run(first, spec(kOtherId));
  std::string name;
  test::with_growing_time([&](auto time) {
    SmoothCall second(stub_, std::chrono::system_clock::now() + time);
    second.send_all(mesh_, kept_spec());
    const auto accepted = second.try_read_accepted();
    EXPECT_EQ(second.finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
    name = accepted.value_or("");
    // A deadline in mid-upload ends the job.
    return accepted &&
           wait_for_state_or_end(stub_, name, v1::STATE_QUEUED).state() == v1::STATE_QUEUED;
  });

  server_.fake().release();

  wait_for_state(stub_, name, v1::STATE_SUCCEEDED);
  AttachCall attach(stub_, name);
  EXPECT_TRUE(attach.finish().ok());
  EXPECT_TRUE(first.finish().ok());
}

TEST_F(SharedJobs, GiveTheirResultAsOftenAsAsked) {
  const std::string name = keep();
  for (int i = 0; i < 3; ++i) {
    AttachCall attach(stub_, name);
    EXPECT_TRUE(attach.finish().ok());
    EXPECT_EQ(attach.result(), mesh_.moved());
  }
  SmoothCall again(stub_);
  EXPECT_EQ(join(again, kept_spec()), name);
  EXPECT_TRUE(again.finish().ok());
  EXPECT_EQ(again.result(), mesh_.moved());
  EXPECT_EQ(server_.fake().started(), 1);
}

TEST_F(SharedJobs, GiveTheirResultFromAnOffset) {
  const std::string name = keep();
  const std::string whole = mesh_.moved();
  for (const std::int64_t offset : {std::int64_t{1}, std::int64_t{24}, std::int64_t{120}}) {
    AttachCall attach(stub_, name, offset);
    EXPECT_TRUE(attach.finish().ok());
    EXPECT_EQ(attach.result(), whole.substr(static_cast<std::size_t>(offset)));
  }
  for (const std::int64_t offset : {std::int64_t{-1}, std::int64_t{121}, INT64_MAX}) {
    AttachCall attach(stub_, name, offset);
    EXPECT_EQ(attach.finish().error_code(), StatusCode::OUT_OF_RANGE);
    EXPECT_EQ(reason(attach.finish()), "RESULT_OFFSET_PAST_END");
  }
}

TEST_F(SharedJobs, TellProgressToWhoAttaches) {
  server_.fake().hold();
  server_.fake().report_progress(3);
  SmoothCall call(stub_);
  const std::string name = run(call, kept_spec());
  AttachCall attach(stub_, name);

  const auto first = attach.read();

  ASSERT_TRUE(first && first->has_progress());
  EXPECT_EQ(first->progress().state(), v1::STATE_RUNNING);
  server_.fake().release();
  EXPECT_TRUE(attach.finish().ok());
  EXPECT_EQ(attach.result(), mesh_.moved());
}

TEST_F(SharedJobs, TellWhoAttachesWhyTheyFailed) {
  server_.fake().fail_with([] { throw InvalidMesh("REPEATED_NODE", "why", {{"element", "7"}}); });
  SmoothCall call(stub_);
  call.send_all(mesh_, kept_spec());
  const std::string name = call.read_accepted();
  call.finish();

  AttachCall attach(stub_, name);

  EXPECT_EQ(attach.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(reason(attach.finish()), "REPEATED_NODE");
}

TEST_F(SharedJobs, KeepWhatACancelLeft) {
  server_.fake().hold();
  SmoothCall call(stub_);
  const std::string name = run(call, kept_spec());
  call.cancel();
  call.finish();

  EXPECT_TRUE(cancel_job(name, true).ok());

  AttachCall attach(stub_, name);
  EXPECT_TRUE(attach.finish().ok());
  EXPECT_EQ(attach.summary()->stop_reason(), v1::STOP_REASON_CANCELLED_WITH_RESULT);
}

TEST_F(SharedJobs, AreCancelledByNameThoughKept) {
  server_.fake().hold();
  SmoothCall call(stub_);
  const std::string name = run(call, kept_spec());
  call.cancel();
  call.finish();

  EXPECT_TRUE(cancel_job(name, false).ok());

  EXPECT_EQ(wait_for_state(stub_, name, v1::STATE_CANCELLED).error().reason(),
            "CANCELLED_BY_JOB_CALL");
  expect_nothing_reserved(stub_);
}

TEST_F(SharedJobs, ExpireWhenTheirTimeHasCome) {
  v1::JobSpec spec = kept_spec();
  spec.mutable_result_ttl()->set_seconds(0);
  spec.mutable_result_ttl()->set_nanos(50'000'000);
  SmoothCall call(stub_);
  call.send_all(mesh_, spec);
  const std::string name = call.read_accepted();
  EXPECT_TRUE(call.finish().ok());

  wait_for_state(stub_, name, v1::STATE_EXPIRED);

  AttachCall attach(stub_, name);
  EXPECT_EQ(attach.finish().error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(reason(attach.finish()), "RESULT_NOT_KEPT");
  expect_nothing_reserved(stub_);
}

TEST_F(SharedJobs, ExpireInTheQueueWithoutACall) {
  server_.fake().hold();
  SmoothCall first(stub_);
  run(first, spec(kOtherId));
  test::with_growing_time([&](auto time) {
    v1::JobSpec spec = kept_spec();
    *spec.mutable_queue_timeout() =
        google::protobuf::util::TimeUtil::MillisecondsToDuration(time.count());
    SmoothCall second(stub_);
    second.send_all(mesh_, spec);
    const std::string name = second.read_accepted();
    const bool queued =
        wait_for_state_or_end(stub_, name, v1::STATE_QUEUED).state() == v1::STATE_QUEUED;
    second.cancel();

    EXPECT_EQ(wait_for_state(stub_, name, v1::STATE_FAILED).error().reason(), "QUEUE_TIMEOUT");
    return queued;
  });
}

TEST_F(SharedJobs, AreForgottenWhenDeleted) {
  const std::string name = keep();

  EXPECT_TRUE(delete_job(name).ok());

  EXPECT_EQ(delete_job(name).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(list_jobs(stub_).jobs_size(), 0);
  expect_nothing_reserved(stub_);
}

TEST_F(SharedJobs, AreNotDeletedBeforeTheirEnd) {
  server_.fake().hold();
  SmoothCall call(stub_);
  const std::string name = run(call, kept_spec());

  EXPECT_EQ(delete_job(name).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(reason(delete_job(name)), "JOB_NOT_FINISHED");
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok());
}

TEST_F(SharedJobs, AreNotFoundByAWrongName) {
  AttachCall attach(stub_, "jobs/none");
  EXPECT_EQ(reason(attach.finish()), "JOB_NOT_FOUND");
}

TEST_F(SharedJobs, RefuseATimeToLiveOfNothing) {
  SmoothCall call(stub_);
  call.send(kept_spec(kId, 0));
  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.detail("field"), "result_ttl");
}

class FewKeptBytes : public SharedJobs {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.max_kept_result_bytes = 250;  // two results of 120
    config.max_result_ttl = std::chrono::seconds(60);
    return config;
  }
  FewKeptBytes() : SharedJobs(config()) {}
};

TEST_F(FewKeptBytes, GiveUpTheOldestResult) {
  const std::string first = keep("01234567-89ab-cdef-0123-456789abcde0");
  const std::string second = keep("01234567-89ab-cdef-0123-456789abcde1");
  const std::string third = keep("01234567-89ab-cdef-0123-456789abcde2");

  EXPECT_EQ(get_job(stub_, first).state(), v1::STATE_EXPIRED);
  EXPECT_EQ(get_job(stub_, second).state(), v1::STATE_SUCCEEDED);
  EXPECT_EQ(get_job(stub_, third).state(), v1::STATE_SUCCEEDED);
}

TEST_F(FewKeptBytes, RefuseAResultThatWouldNeverFit) {
  v1::JobSpec spec = kept_spec();
  spec.mutable_inline_topology()->set_node_count(11);
  SmoothCall call(stub_);
  call.send(spec);

  EXPECT_EQ(call.finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(call.details().reason, "MESH_TOO_LARGE");
  EXPECT_EQ(call.details().retry_delay, std::nullopt);
}

TEST_F(FewKeptBytes, KeepAtMostAsLongAsTheServerLets) {
  const v1::Job job = get_job(stub_, keep());

  EXPECT_EQ(job.expire_time(),
            job.end_time() + google::protobuf::util::TimeUtil::SecondsToDuration(60));
}

}  // namespace
}  // namespace meshsmooth::testing

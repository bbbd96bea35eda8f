// GetJob, ListJobs, the order of the queue.
#include <gmock/gmock.h>
#include <google/protobuf/util/time_util.h>
#include <gtest/gtest.h>

#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

class Jobs : public ::testing::Test {
 protected:
  std::string finish_one() {
    SmoothCall call(stub_);
    call.send_all(mesh_);
    std::string name = call.read_accepted();
    EXPECT_TRUE(call.finish().ok());
    return name;
  }

  static std::vector<std::string> names(const v1::ListJobsResponse& response) {
    std::vector<std::string> names;
    for (const v1::Job& job : response.jobs()) names.push_back(job.name());
    return names;
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
  TwoTetrahedra mesh_;

 private:
  static server::ServerConfig config() {
    server::ServerConfig config = quiet_config();
    config.max_kept_jobs = 3;
    return config;
  }
};

TEST_F(Jobs, AreKnownAfterTheirEnd) {
  const v1::Job job = get_job(stub_, finish_one());

  EXPECT_EQ(job.state(), v1::STATE_SUCCEEDED);
  EXPECT_EQ(job.node_count(), 5);
  EXPECT_EQ(job.element_count(), 2);
  EXPECT_EQ(job.summary().nodes().moved(), 4);
  EXPECT_TRUE(job.has_create_time());
  EXPECT_LE(job.create_time(), job.start_time());
  EXPECT_LE(job.start_time(), job.end_time());
  EXPECT_FALSE(job.has_error());
}

TEST_F(Jobs, ThatFailedSayWhy) {
  server_.fake().fail_with([] { throw InvalidMesh("REPEATED_NODE", "why", {{"element", "7"}}); });
  SmoothCall call(stub_);
  call.send_all(mesh_);
  const std::string name = call.read_accepted();
  call.finish();

  const v1::Job job = get_job(stub_, name);

  EXPECT_EQ(job.state(), v1::STATE_FAILED);
  EXPECT_EQ(job.error().code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(job.error().reason(), "REPEATED_NODE");
  EXPECT_EQ(job.error().metadata().at("element"), "7");
}

TEST_F(Jobs, AreNotFoundWhenUnknown) {
  grpc::ClientContext context;
  v1::GetJobResponse response;

  EXPECT_EQ(stub_.GetJob(&context, {}, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Jobs, AreListedNewestFirstPageByPage) {
  const std::string first = finish_one();
  const std::string second = finish_one();
  const std::string third = finish_one();
  v1::ListJobsRequest request;
  request.set_page_size(2);

  const v1::ListJobsResponse page = list_jobs(stub_, request);
  EXPECT_THAT(names(page), ::testing::ElementsAre(third, second));

  request.set_page_token(page.next_page_token());
  const v1::ListJobsResponse last = list_jobs(stub_, request);
  EXPECT_THAT(names(last), ::testing::ElementsAre(first));
  EXPECT_EQ(last.next_page_token(), "");
}

TEST_F(Jobs, AreForgottenOldestFirst) {
  finish_one();
  const std::string second = finish_one();
  const std::string third = finish_one();
  const std::string fourth = finish_one();

  EXPECT_THAT(names(list_jobs(stub_)), ::testing::ElementsAre(fourth, third, second));
}

TEST_F(Jobs, AreFilteredByState) {
  finish_one();
  SmoothCall call(stub_);
  call.send(TwoTetrahedra::spec());
  const std::string name = call.read_accepted();
  v1::ListJobsRequest request;
  request.add_states(v1::STATE_RECEIVING);

  EXPECT_THAT(names(list_jobs(stub_, request)), ::testing::ElementsAre(name));
}

TEST_F(Jobs, RefuseABadPageToken) {
  for (const char* token : {"x", "12x", "99999999999999999999"}) {
    grpc::ClientContext context;
    v1::ListJobsRequest request;
    request.set_page_token(token);
    v1::ListJobsResponse response;
    EXPECT_EQ(stub_.ListJobs(&context, request, &response).error_code(),
              grpc::StatusCode::INVALID_ARGUMENT);
  }
}

TEST_F(Jobs, RunByPriorityThenByAge) {
  server_.fake().hold();
  std::vector<std::unique_ptr<SmoothCall>> calls;
  std::vector<std::string> jobs;
  for (const v1::Priority priority : {v1::PRIORITY_NORMAL, v1::PRIORITY_BATCH, v1::PRIORITY_NORMAL,
                                      v1::PRIORITY_NORMAL, v1::PRIORITY_INTERACTIVE}) {
    v1::JobSpec spec = TwoTetrahedra::spec();
    spec.set_priority(priority);
    calls.push_back(std::make_unique<SmoothCall>(stub_));
    calls.back()->send_all(mesh_, spec);
    jobs.push_back(calls.back()->read_accepted());
    if (jobs.size() == 1) server_.fake().wait_started(1);
    wait_for_state(stub_, jobs.back(), jobs.size() == 1 ? v1::STATE_RUNNING : v1::STATE_QUEUED);
  }

  EXPECT_EQ(get_job(stub_, jobs[4]).queue_position(), 1);
  EXPECT_EQ(get_job(stub_, jobs[2]).queue_position(), 2);
  EXPECT_EQ(get_job(stub_, jobs[3]).queue_position(), 3);
  EXPECT_EQ(get_job(stub_, jobs[1]).queue_position(), 4);
  EXPECT_EQ(get_job(stub_, jobs[0]).queue_position(), 0);

  server_.fake().release();
  for (const auto& call : calls) EXPECT_TRUE(call->finish().ok());
}

TEST_F(Jobs, TellTheirPlaceInTheQueue) {
  server_.fake().hold();
  SmoothCall first(stub_), second(stub_);
  first.send_all(mesh_);
  server_.fake().wait_started(1);
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_progress_interval();
  second.send_all(mesh_, spec);
  second.read_accepted();

  const auto response = second.read();

  ASSERT_TRUE(response && response->has_progress());
  EXPECT_EQ(response->progress().state(), v1::STATE_QUEUED);
  EXPECT_EQ(response->progress().queue_position(), 1);
  server_.fake().release();
  EXPECT_TRUE(second.finish().ok());
}

}  // namespace
}  // namespace meshsmooth::testing

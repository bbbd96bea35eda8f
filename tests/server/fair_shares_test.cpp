// What one caller leaves to another, without gRPC.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "job.hpp"
#include "job_store.hpp"
#include "meshsmooth/error.hpp"
#include "result_store.hpp"

namespace meshsmooth::server {
namespace {

class FairShares : public ::testing::Test {
 protected:
  /// A job that has succeeded; with its result if it is kept.
  std::shared_ptr<Job> ended_job(const std::string& caller, bool kept) {
    JobRequest request;
    request.caller = caller;
    request.layout.node_count = 1;
    request.layout.blocks = {{ElementType::tetrahedron, 1}};
    request.layout.coordinates_bytes = 24;
    if (kept) request.result_ttl = std::chrono::hours(1);
    const std::int64_t sequence = ++sequence_;
    auto job = std::make_shared<Job>("jobs/" + std::to_string(sequence), sequence, request,
                                     Reservation(), 24, UploadShare(),
                                     std::pmr::new_delete_resource(), [](const Job&) {});
    EXPECT_TRUE(store_.add(job));
    job->queue(QueuePlace());
    EXPECT_TRUE(job->start());
    EXPECT_TRUE(job->finish({}));
    EXPECT_TRUE(job->end());
    if (kept) results_.keep(job);
    for (const auto& forgotten : store_.retire(*job)) results_.drop(*forgotten);
    return job;
  }
  [[nodiscard]] bool listed(const std::shared_ptr<Job>& job) const {
    return store_.find(job->request().caller, job->name()) != nullptr;
  }

  JobStore store_{10};
  ResultStore results_{100};  // four results
  std::int64_t sequence_ = 0;
};

TEST_F(FairShares, OfListedJobsLeaveThoseOfOthers) {
  const auto kept = ended_job("a", true);
  const auto other = ended_job("a", false);
  for (int i = 0; i < 40; ++i) ended_job("b", false);

  EXPECT_TRUE(listed(kept));
  EXPECT_TRUE(listed(other));
  EXPECT_TRUE(kept->has_result());
}

TEST_F(FairShares, OfListedJobsForgetOnesWithoutResultFirst) {
  const auto kept = ended_job("a", true);
  for (int i = 0; i < 40; ++i) ended_job("a", false);

  EXPECT_TRUE(listed(kept));
  EXPECT_TRUE(kept->has_result());
}

TEST_F(FairShares, OfKeptResultsLeaveThoseOfOthers) {
  const auto kept = ended_job("a", true);
  std::vector<std::shared_ptr<Job>> many;
  for (int i = 0; i < 8; ++i) many.push_back(ended_job("b", true));

  EXPECT_TRUE(kept->has_result());
  EXPECT_EQ(many.front()->state(), JobState::expired);
  EXPECT_TRUE(listed(many.front())) << "it is EXPIRED, not unknown";
  EXPECT_TRUE(many.back()->has_result());
}

}  // namespace
}  // namespace meshsmooth::server

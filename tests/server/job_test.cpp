#include "job.hpp"

#include <gtest/gtest.h>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

class JobTest : public ::testing::Test {
 protected:
  JobTest() {
    JobRequest request;
    request.layout.node_count = 1;
    request.layout.coordinates_bytes = 24;
    job_ = std::make_shared<Job>("jobs/1", 1, std::move(request), budget_.reserve({100, 0}), 24,
                                 UploadShare(), std::pmr::new_delete_resource(),
                                 [this](const Job&) { ++end_count_; });
    observer_id_ = job_->observe([this] { ++change_count_; }).value();
  }

  static std::exception_ptr cancelled() { return std::make_exception_ptr(Cancelled("WHY", "")); }
  static std::exception_ptr failed() { return std::make_exception_ptr(InvalidMesh("BAD", "")); }

  MemoryBudget budget_{{1000, {0}}};
  JobQueue queue_{1, 1000};
  int end_count_ = 0;
  int change_count_ = 0;
  int observer_id_ = 0;
  std::shared_ptr<Job> job_;
};

TEST_F(JobTest, WalksFromReceivingToSucceeded) {
  EXPECT_EQ(job_->state(), JobState::receiving);
  job_->queue(queue_.take_place(kAnonymous, 24));
  EXPECT_EQ(job_->state(), JobState::queued);
  job_->start();
  EXPECT_EQ(job_->state(), JobState::running);
  job_->finish({});
  EXPECT_EQ(job_->state(), JobState::sending);
  EXPECT_TRUE(job_->end());
  EXPECT_EQ(job_->state(), JobState::succeeded);
  EXPECT_NE(job_->snapshot().summary, nullptr);
}

TEST_F(JobTest, EndsOnce) {
  EXPECT_TRUE(job_->end(failed()));
  EXPECT_FALSE(job_->end(cancelled()));

  EXPECT_EQ(job_->state(), JobState::failed);
  EXPECT_EQ(end_count_, 1);
}

TEST_F(JobTest, GivesAllMemoryBackAtItsEnd) {
  EXPECT_EQ(budget_.reserved().host_bytes, 100);
  job_->queue(queue_.take_place(kAnonymous, 24));
  EXPECT_THROW(queue_.check_room(kAnonymous, 24), OutOfMemory);
  job_->end(failed());

  EXPECT_EQ(budget_.reserved().host_bytes, 0);
  EXPECT_NO_THROW(queue_.check_room(kAnonymous, 24));
}

TEST_F(JobTest, EndsByTheFirstStopThatWasRequested) {
  EXPECT_TRUE(job_->request_stop(cancelled()));
  EXPECT_FALSE(job_->request_stop(failed()));
  EXPECT_TRUE(job_->stop_token().stop_requested());
  job_->end(failed());

  EXPECT_EQ(job_->state(), JobState::cancelled);
}

// The call may be gone when the lane finishes: nobody would send the result.
TEST_F(JobTest, EndsInsteadOfSendingWhenAStopWasRequested) {
  job_->queue(queue_.take_place(kAnonymous, 24));
  job_->start();
  job_->request_stop(cancelled());
  EXPECT_FALSE(job_->finish({}));
  EXPECT_EQ(job_->snapshot().result, nullptr);
  job_->end(job_->stop_cause());

  EXPECT_EQ(job_->state(), JobState::cancelled);
  EXPECT_EQ(end_count_, 1);
}

TEST_F(JobTest, IsRejectedOnlyBeforeItRuns) {
  job_->queue(queue_.take_place(kAnonymous, 24));
  job_->start();

  EXPECT_FALSE(job_->reject(failed()));
  EXPECT_FALSE(job_->stop_token().stop_requested());
  job_->finish({});
  EXPECT_EQ(job_->state(), JobState::sending);
}

TEST_F(JobTest, DoesNotRunOnceItIsRejected) {
  job_->queue(queue_.take_place(kAnonymous, 24));

  EXPECT_TRUE(job_->reject(failed()));
  EXPECT_FALSE(job_->start());
  EXPECT_EQ(job_->state(), JobState::queued);
}

TEST_F(JobTest, TellsItsObserverOfEveryChange) {
  job_->queue(queue_.take_place(kAnonymous, 24));
  job_->start();
  job_->report({.stage = Stage::iterate, .iteration = 3});
  job_->request_stop(cancelled());
  job_->end(cancelled());

  EXPECT_EQ(change_count_, 4);
  EXPECT_EQ(job_->snapshot().progress.iteration, 3);
}

TEST_F(JobTest, TellsOfItsProgressOnlyWhoWantsToHear) {
  int changes = 0;
  (void)job_->observe([&] { ++changes; }, false);
  job_->queue(queue_.take_place(kAnonymous, 24));
  job_->start();
  job_->report({});
  job_->report({});
  job_->finish({});
  EXPECT_EQ(change_count_ - changes, 2);
  EXPECT_EQ(job_->snapshot().progress_count, 2);
}

TEST_F(JobTest, MeasuresTheStepsUpToItsEnd) {
  job_->queue(queue_.take_place(kAnonymous, 24));
  job_->end(cancelled());
  const JobTimes times = job_->snapshot().times;

  EXPECT_GE(times.receive_seconds(), 0);
  EXPECT_GE(times.queue_seconds(), 0);
  EXPECT_EQ(times.run_seconds(), 0);
  EXPECT_EQ(times.send_seconds(), 0);
}

}  // namespace
}  // namespace meshsmooth::server

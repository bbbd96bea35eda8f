// The order of messages and times, without sockets and calls.
#include "rpc/result_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory_resource>
#include <string>
#include <tuple>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;
using Action = ResultStream::Action;

constexpr std::int64_t kBytes = 240;

std::shared_ptr<const JobResult> make_result() {
  auto result = std::make_shared<JobResult>();
  result->coordinates = wire::ByteArray(kBytes, std::pmr::new_delete_resource());
  for (std::size_t i = 0; i < kBytes; ++i) {
    result->coordinates.data()[i] = static_cast<std::byte>(i);
  }
  return result;
}

std::string reason_of(const std::exception_ptr& error) {
  if (!error) return "";
  try {
    std::rethrow_exception(error);
  } catch (const Error& e) {
    return e.reason();
  }
}

class ResultStreamTest : public ::testing::Test {
 protected:
  static ResultStream::Options options() {
    return {.progress_interval = 1s, .chunk_bytes = 100, .result_bytes = kBytes};
  }

  ResultStream::Step next(ResultStream& stream) {
    error_ = reason_of(stream.notice(job_));
    return stream.next(job_, position_, now_);
  }
  Action next_action(ResultStream& stream) { return next(stream).action; }

  void become(JobState state) {
    job_.state = state;
    if (state == JobState::sending) job_.result = make_result();
    if (state == JobState::queued) job_.times.queued = now_;
  }
  static std::exception_ptr cancelled() { return std::make_exception_ptr(Cancelled("WHY", "")); }

  JobSnapshot job_;
  int position_ = 0;
  Clock::time_point now_{1h};
  std::string error_;
};

TEST_F(ResultStreamTest, SendsHeaderChunksAndSummaryInThisOrder) {
  ResultStream stream(options());
  become(JobState::sending);

  EXPECT_EQ(next_action(stream), Action::send_header);
  for (std::int64_t offset = 0; offset < kBytes; offset += 100) {
    const ResultStream::Step step = next(stream);
    EXPECT_EQ(step.action, Action::send_chunk);
    EXPECT_EQ(step.offset, offset);
    EXPECT_EQ(step.data.size(),
              static_cast<std::size_t>(std::min<std::int64_t>(100, kBytes - offset)));
    EXPECT_EQ(step.data[0], static_cast<std::byte>(offset));
  }
  EXPECT_EQ(next_action(stream), Action::complete_job);
  become(JobState::succeeded);
  EXPECT_EQ(next_action(stream), Action::send_summary);
  EXPECT_EQ(next_action(stream), Action::wait);
  EXPECT_EQ(error_, "");
}

TEST_F(ResultStreamTest, AnnouncesAResultInPlaceAsSoonAsTheJobIsQueued) {
  ResultStream::Options shared = options();
  shared.in_place = true;
  ResultStream stream(shared);
  EXPECT_EQ(next_action(stream), Action::wait);
  become(JobState::queued);
  const ResultStream::Step header = next(stream);
  EXPECT_EQ(header.action, Action::send_header);
  EXPECT_TRUE(header.in_place);
  EXPECT_EQ(next_action(stream), Action::send_progress);
  EXPECT_EQ(next_action(stream), Action::wait);
  become(JobState::sending);
  EXPECT_EQ(next_action(stream), Action::complete_job);
  become(JobState::succeeded);
  EXPECT_EQ(next_action(stream), Action::send_summary);
  EXPECT_EQ(next_action(stream), Action::wait);
  EXPECT_EQ(error_, "");
}

TEST_F(ResultStreamTest, DoesNotCompleteAJobThatHasSucceeded) {
  ResultStream::Options at_end = options();
  at_end.offset = kBytes;
  ResultStream stream(at_end);
  job_.result = make_result();
  become(JobState::succeeded);

  EXPECT_EQ(next_action(stream), Action::send_header);
  EXPECT_EQ(next_action(stream), Action::send_summary);
}

TEST_F(ResultStreamTest, BeginsAtTheOffset) {
  ResultStream::Options later = options();
  later.offset = 150;
  ResultStream stream(later);
  become(JobState::sending);

  EXPECT_EQ(next_action(stream), Action::send_header);
  const ResultStream::Step step = next(stream);
  EXPECT_EQ(step.offset, 150);
  EXPECT_EQ(step.data.size(), 90U);
  EXPECT_EQ(next_action(stream), Action::complete_job);
}

TEST_F(ResultStreamTest, SendsWhatItHasTakenThoughTheJobExpires) {
  ResultStream stream(options());
  job_.result = make_result();
  become(JobState::succeeded);
  EXPECT_EQ(next_action(stream), Action::send_header);
  job_.result = nullptr;
  become(JobState::expired);

  EXPECT_EQ(next_action(stream), Action::send_chunk);
  EXPECT_EQ(error_, "");
}

TEST_F(ResultStreamTest, ReportsEachChangeOnceAndAtMostOncePerInterval) {
  ResultStream stream(options());
  EXPECT_EQ(next_action(stream), Action::wait);  // receiving is where every job begins
  become(JobState::running);
  EXPECT_EQ(next_action(stream), Action::send_progress);
  EXPECT_EQ(next_action(stream), Action::wait);

  ++job_.progress_count;
  now_ += 300ms;
  const ResultStream::Step early = next(stream);
  EXPECT_EQ(early.action, Action::wait);
  EXPECT_EQ(early.wake, now_ + 700ms);

  now_ += 700ms;
  EXPECT_EQ(next_action(stream), Action::send_progress);
  const ResultStream::Step nothing = next(stream);
  EXPECT_EQ(nothing.action, Action::wait);
  EXPECT_FALSE(nothing.wake);
}

TEST_F(ResultStreamTest, ReportsTheFirstStateAtOnceWhereAskedTo) {
  ResultStream::Options attached = options();
  attached.report_at_once = true;
  ResultStream stream(attached);

  EXPECT_EQ(next_action(stream), Action::send_progress);
  EXPECT_EQ(next_action(stream), Action::wait);
}

TEST_F(ResultStreamTest, PollsThePositionInTheQueue) {
  ResultStream stream(options());
  EXPECT_FALSE(stream.needs_queue_position(job_));
  become(JobState::queued);
  EXPECT_TRUE(stream.needs_queue_position(job_));
  position_ = 2;
  EXPECT_EQ(next_action(stream), Action::send_progress);
  EXPECT_EQ(next(stream).wake, now_ + 100ms);

  now_ += 2s;
  position_ = 1;
  EXPECT_EQ(next_action(stream), Action::send_progress);
  become(JobState::sending);
  EXPECT_EQ(next_action(stream), Action::send_header);
  EXPECT_FALSE(stream.needs_queue_position(job_));
}

TEST_F(ResultStreamTest, ReportsNothingUnlessAskedTo) {
  ResultStream::Options quiet = options();
  quiet.progress_interval.reset();
  ResultStream stream(quiet);
  become(JobState::queued);
  position_ = 1;
  EXPECT_FALSE(stream.needs_queue_position(job_));

  const ResultStream::Step step = next(stream);
  EXPECT_EQ(step.action, Action::wait);
  EXPECT_FALSE(step.wake);
}

TEST_F(ResultStreamTest, BoundsTheIntervalOfProgress) {
  for (const auto& [asked, used] : {std::pair<std::chrono::nanoseconds, Clock::duration>{0ns, 10ms},
                                    {std::chrono::nanoseconds::max(), 1h}}) {
    ResultStream::Options often = options();
    often.progress_interval = asked;
    ResultStream stream(often);
    become(JobState::running);
    EXPECT_EQ(next_action(stream), Action::send_progress);
    ++job_.progress_count;
    EXPECT_EQ(next(stream).wake, now_ + used);
    job_ = {};
  }
}

TEST_F(ResultStreamTest, FailsWithTheJob) {
  ResultStream stream(options());
  become(JobState::failed);
  job_.error = std::make_exception_ptr(InvalidMesh("BAD", ""));

  EXPECT_EQ(reason_of(stream.notice(job_)), "BAD");
}

TEST_F(ResultStreamTest, FailsWhenTheJobIsAskedToStopInItsOwnTurn) {
  job_.stop_cause = cancelled();
  ResultStream::Options attached = options();
  attached.ends_uploads = false;
  for (const auto& [state, own, other] :
       {std::tuple{JobState::receiving, "WHY", ""}, std::tuple{JobState::queued, "", ""},
        std::tuple{JobState::running, "", ""}, std::tuple{JobState::sending, "WHY", "WHY"}}) {
    become(state);
    ResultStream uploading(options()), watching(attached);
    EXPECT_EQ(reason_of(uploading.notice(job_)), own) << job_state_name(state);
    EXPECT_EQ(reason_of(watching.notice(job_)), other) << job_state_name(state);
  }
}

TEST_F(ResultStreamTest, FailsWhenTheResultIsNoLongerKept) {
  ResultStream stream(options());
  become(JobState::expired);

  EXPECT_EQ(reason_of(stream.notice(job_)), "RESULT_NOT_KEPT");
}

TEST_F(ResultStreamTest, AsksForTheMeshWhenTheCallThatUploadedItIsLost) {
  ResultStream::Options joined = options();
  joined.upload_by_another_call = true;
  become(JobState::cancelled);
  job_.error = cancelled();
  ResultStream other(joined), own(options());

  EXPECT_EQ(reason_of(other.notice(job_)), "UPLOAD_LOST");
  EXPECT_EQ(reason_of(own.notice(job_)), "WHY");

  job_.times.queued = now_;  // the mesh was complete
  EXPECT_EQ(reason_of(other.notice(job_)), "WHY");
}

TEST_F(ResultStreamTest, HoldsTheResultUntilItIsReleased) {
  ResultStream stream(options());
  become(JobState::sending);
  std::weak_ptr<const JobResult> result = job_.result;
  EXPECT_EQ(next_action(stream), Action::send_header);
  job_.result = nullptr;
  EXPECT_FALSE(result.expired());

  stream.release();
  EXPECT_TRUE(result.expired());
}

}  // namespace
}  // namespace meshsmooth::server

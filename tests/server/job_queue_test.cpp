#include "job_queue.hpp"

#include <gtest/gtest.h>

#include <future>
#include <thread>
#include <vector>

#include "job.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::shared_ptr<Job> make_job(std::int64_t sequence, const std::string& caller = kAnonymous) {
  JobRequest request;
  request.caller = caller;
  request.layout.node_count = 1;
  request.layout.coordinates_bytes = 24;
  return std::make_shared<Job>("jobs/" + std::to_string(sequence), sequence, std::move(request),
                               Reservation(), 24, UploadShare(), std::pmr::new_delete_resource(),
                               [](const Job&) {});
}

void push(JobQueue& queue, const std::shared_ptr<Job>& job, Priority priority) {
  queue.push(job, {job->request().caller, job->device(), priority});
}

TEST(JobQueue, HandsOutByPriorityThenByAge) {
  JobQueue queue(10, 1000);
  for (const auto& [sequence, priority] :
       {std::pair{1, Priority::batch}, std::pair{2, Priority::normal},
        std::pair{3, Priority::interactive}, std::pair{4, Priority::normal}}) {
    push(queue, make_job(sequence), priority);
  }

  std::vector<std::int64_t> order;
  for (int i = 0; i < 4; ++i) order.push_back(queue.pop()->sequence());
  EXPECT_EQ(order, (std::vector<std::int64_t>{3, 2, 4, 1}));
}

std::vector<std::int64_t> pop_all(JobQueue& queue, int count) {
  std::vector<std::int64_t> order;
  for (int i = 0; i < count; ++i) order.push_back(queue.pop()->sequence());
  return order;
}

TEST(JobQueue, LetsWaitingJobsRiseSoThatNoneStarves) {
  using namespace std::chrono_literals;
  JobQueue queue(10, 1000, 30ms);
  push(queue, make_job(1), Priority::batch);
  push(queue, make_job(2), Priority::normal);
  std::this_thread::sleep_for(70ms);  // two levels
  push(queue, make_job(3), Priority::interactive);
  push(queue, make_job(4), Priority::normal);

  EXPECT_EQ(pop_all(queue, 4), (std::vector<std::int64_t>{1, 2, 3, 4}));
}

TEST(JobQueue, TakesTheCallersOfALevelInTurns) {
  JobQueue queue(10, 1000);
  for (const auto& [sequence, caller] : {std::pair{1, "a"}, std::pair{2, "a"}, std::pair{3, "a"},
                                         std::pair{4, "b"}, std::pair{5, "b"}, std::pair{6, "c"}}) {
    push(queue, make_job(sequence, caller), Priority::normal);
  }
  const auto urgent = make_job(7, "a");
  push(queue, urgent, Priority::interactive);
  EXPECT_EQ(queue.position(*urgent), 1);

  EXPECT_EQ(pop_all(queue, 7), (std::vector<std::int64_t>{7, 4, 6, 1, 5, 2, 3}));
}

// "a" has a job running, so "b" goes first though it came later; once that is done, by age.
TEST(JobQueue, CountsWhatACallerHasRunning) {
  JobQueue queue(10, 1000);
  push(queue, make_job(1, "a"), Priority::normal);
  const auto running = queue.pop();
  const auto second = make_job(2, "a");
  const auto other = make_job(3, "b");
  push(queue, second, Priority::normal);
  push(queue, other, Priority::normal);
  EXPECT_EQ(queue.position(*other), 1);
  EXPECT_EQ(queue.position(*second), 2);

  queue.done(running->request().caller);

  EXPECT_EQ(queue.position(*second), 1);
}

TEST(DrainRate, ForeseesByWhatHasGone) {
  using namespace std::chrono_literals;
  DrainRate rate;
  const auto start = DrainRate::Clock::now();
  EXPECT_EQ(rate.time_for(5, start), 1s);                         // nothing is known
  for (int i = 0; i < 100; ++i) rate.add(10, start + i * 100ms);  // 100 a second
  const auto now = start + 10s;
  const auto delay = std::chrono::duration<double>(rate.time_for(500, now)).count();
  EXPECT_GT(delay, 4);
  EXPECT_LT(delay, 6);
  EXPECT_EQ(rate.time_for(1e9, now), 30s);
  EXPECT_EQ(rate.time_for(1, now), 50ms);
  EXPECT_GT(rate.time_for(500, now + 60s), rate.time_for(500, now));  // it has become slower
}

TEST(JobQueue, KnowsThePlaceOfAJob) {
  JobQueue queue(10, 1000);
  const auto batch = make_job(1);
  const auto normal = make_job(2);
  EXPECT_EQ(queue.position(*batch), 0);
  push(queue, batch, Priority::batch);
  push(queue, normal, Priority::normal);

  EXPECT_EQ(queue.position(*normal), 1);
  EXPECT_EQ(queue.position(*batch), 2);
}

TEST(JobQueue, RemovesAJobOnce) {
  JobQueue queue(10, 1000);
  const auto job = make_job(1);
  push(queue, job, Priority::normal);

  EXPECT_TRUE(queue.remove(*job));
  EXPECT_FALSE(queue.remove(*job));
  EXPECT_EQ(queue.position(*job), 0);
}

TEST(JobQueue, IsBoundedByJobs) {
  JobQueue queue(2, 1000);
  auto first = queue.take_place(kAnonymous, 1);
  EXPECT_NO_THROW(queue.check_room(kAnonymous, 1));
  const auto second = queue.take_place(kAnonymous, 1);
  EXPECT_THROW(queue.check_room(kAnonymous, 1), OutOfMemory);

  first = QueuePlace();
  EXPECT_NO_THROW(queue.check_room(kAnonymous, 1));
}

TEST(JobQueue, HasRoomForACallerWhoHasLessThanAShareOfThePlaces) {
  JobQueue queue(4, 1000);
  std::vector<QueuePlace> places;
  for (int i = 0; i < 4; ++i) places.push_back(queue.take_place("a", 1));
  EXPECT_THROW(queue.check_room("a", 1), OutOfMemory);
  EXPECT_NO_THROW(queue.check_room("b", 1));
  EXPECT_THROW(queue.check_room("b", 501), OutOfMemory) << "more than half of the bytes";

  for (int i = 0; i < 2; ++i) places.push_back(queue.take_place("b", 1));
  EXPECT_THROW(queue.check_room("b", 1), OutOfMemory);
  EXPECT_NO_THROW(queue.check_room("c", 1));
}

TEST(JobQueue, HasALaneForCallersWithoutARunningJob) {
  JobQueue queue(10, 1000);
  push(queue, make_job(1, "a"), Priority::normal);
  push(queue, make_job(2, "a"), Priority::interactive);
  EXPECT_EQ(queue.pop()->sequence(), 2);  // the only other lane is busy now

  std::promise<std::int64_t> taken;
  std::thread lane([&] { taken.set_value(queue.pop(0, JobQueue::Takes::newcomers)->sequence()); });
  push(queue, make_job(3, "a"), Priority::interactive);
  push(queue, make_job(4, "b"), Priority::batch);
  EXPECT_EQ(taken.get_future().get(), 4);
  lane.join();
  EXPECT_EQ(queue.pop()->sequence(), 3);
}

TEST(JobQueue, LeavesJobsToALaneForAnyWhileOneWaits) {
  JobQueue queue(10, 1000);
  std::promise<std::int64_t> by_any, by_newcomers;
  std::thread any([&] { by_any.set_value(queue.pop()->sequence()); });
  std::thread newcomers([&] {
    const auto job = queue.pop(0, JobQueue::Takes::newcomers);
    by_newcomers.set_value(job ? job->sequence() : 0);
  });
  while (!queue.has_idle_lane()) std::this_thread::yield();
  push(queue, make_job(1, "a"), Priority::normal);
  EXPECT_EQ(by_any.get_future().get(), 1);
  push(queue, make_job(2, "a"), Priority::normal);
  queue.done("a");
  EXPECT_EQ(by_newcomers.get_future().get(), 2);
  any.join();
  newcomers.join();
}

TEST(JobQueue, IsBoundedByBytes) {
  JobQueue queue(10, 100);
  const auto first = queue.take_place(kAnonymous, 60);

  EXPECT_THROW(queue.check_room(kAnonymous, 41), OutOfMemory);
  EXPECT_NO_THROW(queue.check_room(kAnonymous, 40));
}

TEST(JobQueue, GivesAPlaceBackWhenTheJobStarts) {
  JobQueue queue(1, 1000);
  const auto job = make_job(1);
  EXPECT_NO_THROW(queue.check_room(kAnonymous, 1));  // an upload takes no place
  job->queue(queue.take_place(kAnonymous, 24));
  EXPECT_THROW(queue.check_room(kAnonymous, 1), OutOfMemory);
  job->start();

  EXPECT_NO_THROW(queue.check_room(kAnonymous, 1));
}

TEST(JobQueue, AlwaysHasAPlaceForAJobThatWasUploaded) {
  JobQueue queue(1, 1000);
  const auto first = queue.take_place(kAnonymous, 1000);
  EXPECT_NO_THROW((void)queue.take_place(kAnonymous, 1000));
}

TEST(JobQueue, WakesWhoWaitsWhenItCloses) {
  JobQueue queue(1, 1000);
  std::shared_ptr<Job> popped = make_job(1);
  std::thread waiter([&] { popped = queue.pop(); });
  queue.close();
  waiter.join();

  EXPECT_EQ(popped, nullptr);
}

}  // namespace
}  // namespace meshsmooth::server

#include "job_queue.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "job.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

std::shared_ptr<Job> make_job(JobQueue& queue, std::int64_t sequence) {
  JobRequest request;
  request.layout.node_count = 1;
  request.layout.coordinates_bytes = 24;
  return std::make_shared<Job>("jobs/" + std::to_string(sequence), sequence, std::move(request),
                               Reservation(), 24, queue.admit(24), std::pmr::new_delete_resource(),
                               [](const Job&) {});
}

TEST(JobQueue, HandsOutByPriorityThenByAge) {
  JobQueue queue(10, 1000);
  for (const auto& [sequence, priority] :
       {std::pair{1, Priority::batch}, std::pair{2, Priority::normal},
        std::pair{3, Priority::interactive}, std::pair{4, Priority::normal}}) {
    queue.push(make_job(queue, sequence), priority);
  }

  std::vector<std::int64_t> order;
  for (int i = 0; i < 4; ++i) order.push_back(queue.pop()->sequence());
  EXPECT_EQ(order, (std::vector<std::int64_t>{3, 2, 4, 1}));
}

TEST(JobQueue, KnowsThePlaceOfAJob) {
  JobQueue queue(10, 1000);
  const auto batch = make_job(queue, 1);
  const auto normal = make_job(queue, 2);
  EXPECT_EQ(queue.position(*batch), 0);
  queue.push(batch, Priority::batch);
  queue.push(normal, Priority::normal);

  EXPECT_EQ(queue.position(*normal), 1);
  EXPECT_EQ(queue.position(*batch), 2);
}

TEST(JobQueue, RemovesAJobOnce) {
  JobQueue queue(10, 1000);
  const auto job = make_job(queue, 1);
  queue.push(job, Priority::normal);

  EXPECT_TRUE(queue.remove(*job));
  EXPECT_FALSE(queue.remove(*job));
  EXPECT_EQ(queue.position(*job), 0);
}

TEST(JobQueue, IsBoundedByJobs) {
  JobQueue queue(2, 1000);
  auto first = queue.admit(1);
  const auto second = queue.admit(1);
  EXPECT_THROW((void)queue.admit(1), OutOfMemory);

  first = QueuePlace();
  EXPECT_NO_THROW((void)queue.admit(1));
}

TEST(JobQueue, IsBoundedByBytes) {
  JobQueue queue(10, 100);
  const auto first = queue.admit(60);

  EXPECT_THROW((void)queue.admit(41), OutOfMemory);
  EXPECT_NO_THROW((void)queue.admit(40));
}

TEST(JobQueue, GivesAPlaceBackWhenTheJobStarts) {
  JobQueue queue(1, 1000);
  const auto job = make_job(queue, 1);
  EXPECT_THROW((void)queue.admit(1), OutOfMemory);
  job->queue();
  job->start();

  EXPECT_NO_THROW((void)queue.admit(1));
}

TEST(JobQueue, WakesWhoWaitsWhenItCloses) {
  JobQueue queue(1, 1000);
  std::shared_ptr<Job> popped = make_job(queue, 1);
  std::thread waiter([&] { popped = queue.pop(); });
  queue.close();
  waiter.join();

  EXPECT_EQ(popped, nullptr);
}

}  // namespace
}  // namespace meshsmooth::server

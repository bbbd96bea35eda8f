#include "upload_rate.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kRate = 32 * 1024;
constexpr auto kWindow = 40s;

class UploadRateTest : public ::testing::Test {
 protected:
  UploadRateTest() { rate_.start(now_); }

  /// Sends messages of this size at so many bytes per second; how long until the upload is ended.
  UploadRate::Clock::duration survives(std::int64_t message, double bytes_per_second,
                                       UploadRate::Clock::duration limit) {
    const auto interval = std::chrono::duration_cast<UploadRate::Clock::duration>(
        std::chrono::duration<double>(static_cast<double>(message) / bytes_per_second));
    const auto begin = now_;
    while (now_ - begin < limit) {
      if (now_ + interval >= *rate_.deadline()) return *rate_.deadline() - begin;
      now_ += interval;
      rate_.add(message, now_);
    }
    return limit;
  }

  UploadRate::Clock::time_point now_;
  UploadRate rate_{kRate, kWindow};
};

TEST_F(UploadRateTest, EndsAnUploadThatStopsAfterTheWindow) {
  for (int i = 0; i < 1000; ++i) rate_.add(1 << 20, now_ += 1ms);  // fast until now

  EXPECT_EQ(*rate_.deadline(), now_ + kWindow);
}

TEST_F(UploadRateTest, EndsAnUploadThatStopsEarlierWhereItMayFallBehindByLess) {
  for (int i = 0; i < 1000; ++i) rate_.add(1 << 20, now_ += 1ms);

  EXPECT_EQ(*rate_.deadline(2s), now_ + 2s);
  EXPECT_EQ(*rate_.deadline(2 * kWindow), now_ + kWindow);
  EXPECT_FALSE(UploadRate(0, kWindow).deadline(2s));
}

TEST_F(UploadRateTest, EndsALargeUploadThatWouldTakeTooLong) {
  UploadRate rate(kRate, kWindow);
  rate.require(2 * kRate);
  rate.require(kRate / 2);  // the larger one holds
  rate.start(now_);
  EXPECT_EQ(rate.bytes_per_second(), 2 * kRate);
  const auto begin = now_;
  for (; now_ < *rate.deadline() && now_ < begin + 24h; now_ += 1s) rate.add(kRate, now_);
  EXPECT_LT(now_, begin + 3 * kWindow);
}

TEST_F(UploadRateTest, EndsATrickleSoonAfterTheWindow) {
  EXPECT_LT(survives(1, 1, 1h), kWindow + 1s);
}

TEST_F(UploadRateTest, EndsWhatIsJustBelowTheRateInTheEnd) {
  EXPECT_LT(survives(1 << 10, 0.9 * kRate, 1h), 11 * kWindow);
}

TEST_F(UploadRateTest, NeverEndsWhatIsJustAboveTheRate) {
  EXPECT_EQ(survives(1 << 10, 1.01 * kRate, 24h), 24h);
}

TEST_F(UploadRateTest, AllowsForTheTimeThatAWholeChunkTakes) {
  EXPECT_EQ(survives(1 << 20, 1.01 * kRate, 24h), 24h);
}

TEST_F(UploadRateTest, AllowsForAPauseWithinTheWindow) {
  for (int i = 0; i < 1000; ++i) rate_.add(1 << 20, now_ += 1s);
  now_ += kWindow - 1s;
  EXPECT_LT(now_, *rate_.deadline());
  rate_.add(kRate * 40, now_);

  EXPECT_EQ(*rate_.deadline(), now_ + kWindow);
}

TEST(UploadRate, HasNoDeadlineBeforeTheUploadNorWithoutAMinimum) {
  UploadRate waiting(kRate, kWindow), unlimited(0, kWindow);
  waiting.add(1, {});
  unlimited.start({});
  unlimited.add(1, {});

  EXPECT_FALSE(waiting.deadline());
  EXPECT_FALSE(unlimited.deadline());
}

TEST(UploadRate, TakesAnyNumberOfBytes) {
  UploadRate slow(1, kWindow);
  slow.start({});
  slow.add(std::numeric_limits<std::int64_t>::max(), {});

  EXPECT_EQ(*slow.deadline(), UploadRate::Clock::time_point() + kWindow);
}

}  // namespace
}  // namespace meshsmooth::server

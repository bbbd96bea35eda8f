#include "upload_share.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

std::string refusal(UploadShares& shares, const std::string& connection, MemoryEstimate need) {
  try {
    (void)shares.take(connection, need);
  } catch (const OutOfMemory& error) {
    return error.reason();
  }
  return "";
}

TEST(UploadShares, LimitWhatTheUploadsOfAConnectionHold) {
  UploadShares shares({100, 1000});
  const auto first = shares.take("a", {60, 0});

  EXPECT_EQ(refusal(shares, "a", {41, 0}), "QUOTA_EXCEEDED");
  EXPECT_EQ(refusal(shares, "a", {40, 0}), "");
}

TEST(UploadShares, LimitDeviceMemoryToo) {
  UploadShares shares({1000, 100});
  const auto first = shares.take("a", {0, 60});

  EXPECT_EQ(refusal(shares, "a", {0, 41}), "QUOTA_EXCEEDED");
  EXPECT_EQ(refusal(shares, "a", {0, 40}), "");
}

TEST(UploadShares, LeaveOtherConnectionsTheirs) {
  UploadShares shares({100, 0});
  const auto first = shares.take("a", {100, 0});

  EXPECT_EQ(refusal(shares, "b", {100, 0}), "");
}

TEST(UploadShares, AllowOneUploadOfAnySize) {
  UploadShares shares({100, 0});
  const auto large = shares.take("a", {1000, 5});

  EXPECT_EQ(refusal(shares, "a", {1, 0}), "QUOTA_EXCEEDED");
}

TEST(UploadShares, TellWhenToRetryByTheRateAtWhichUploadsFinish) {
  UploadShares shares({100, 0});
  { const auto finished = shares.take("a", {100, 0}); }
  const auto stalled = shares.take("a", {100, 0});
  try {
    (void)shares.take("a", {100, 0});
    FAIL() << "nothing thrown";
  } catch (const Busy& busy) {
    EXPECT_LT(busy.retry_delay(), std::chrono::seconds(1));  // what is told when nothing is known
  }
}

TEST(UploadShares, AreReleasedWithTheUpload) {
  UploadShares shares({100, 0});
  {
    UploadShare first = shares.take("a", {100, 0});
    const UploadShare moved = std::move(first);
    EXPECT_EQ(refusal(shares, "a", {1, 0}), "QUOTA_EXCEEDED");
  }
  EXPECT_EQ(refusal(shares, "a", {100, 0}), "");
}

TEST(UploadShares, DoNotLimitCallersWithoutAConnectionOfTheirOwn) {
  UploadShares shares({100, 0});
  const auto first = shares.take("", {100, 0});

  EXPECT_EQ(refusal(shares, "", {100, 0}), "");
}

}  // namespace
}  // namespace meshsmooth::server

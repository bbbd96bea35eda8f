#include "wire/status_details.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "meshsmooth/v1/error_details.pb.h"

namespace meshsmooth::wire {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;
using namespace std::chrono_literals;

StatusDetails queue_full() {
  return {.code = 8,
          .message = "the queue is full",
          .reason = "QUEUE_FULL",
          .metadata = {{"queued_jobs", "3"}, {"field", "spec"}},
          .retry_delay = 1500ms};
}

TEST(StatusDetails, ComeBackAsTheyWereSent) {
  const auto decoded = decode_status_details(encode_status_details(queue_full()));

  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->code, 8);
  EXPECT_EQ(decoded->message, "the queue is full");
  EXPECT_EQ(decoded->reason, "QUEUE_FULL");
  EXPECT_THAT(decoded->metadata, ElementsAre(Pair("field", "spec"), Pair("queued_jobs", "3")));
  EXPECT_EQ(decoded->retry_delay, 1500ms);
}

TEST(StatusDetails, WithoutRetryDelayAskForNoRetry) {
  StatusDetails details = queue_full();
  details.retry_delay.reset();

  EXPECT_FALSE(decode_status_details(encode_status_details(details))->retry_delay);
}

TEST(StatusDetails, CarryTheTypeUrlsOfGoogleRpc) {
  v1::Status status;
  ASSERT_TRUE(status.ParseFromString(encode_status_details(queue_full())));

  ASSERT_EQ(status.details_size(), 3);
  EXPECT_EQ(status.details(0).type_url(), "type.googleapis.com/google.rpc.ErrorInfo");
  EXPECT_EQ(status.details(1).type_url(), "type.googleapis.com/google.rpc.BadRequest");
  EXPECT_EQ(status.details(2).type_url(), "type.googleapis.com/google.rpc.RetryInfo");
}

TEST(StatusDetails, NameTheFieldInABadRequest) {
  v1::Status status;
  ASSERT_TRUE(status.ParseFromString(encode_status_details(queue_full())));
  v1::BadRequest bad_request;
  ASSERT_TRUE(bad_request.ParseFromString(status.details(1).value()));

  EXPECT_EQ(bad_request.field_violations(0).field(), "spec");
}

TEST(StatusDetails, StayBelowFourKibibytes) {
  StatusDetails details = queue_full();
  details.message.assign(100'000, 'x');
  for (int i = 0; i < 100; ++i) {
    details.metadata.emplace_back("key" + std::to_string(i), std::string(5000, 'y'));
  }

  EXPECT_LT(encode_status_details(details).size(), 4096U);
}

TEST(StatusDetails, AreCutBetweenCharacters) {
  StatusDetails details = queue_full();
  details.message = "a";
  for (int i = 0; i < 1000; ++i) details.message += "\u00fc";

  const auto decoded = decode_status_details(encode_status_details(details));

  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->message.size() % 2, 1U);
}

TEST(StatusDetails, OfOthersHaveNoReason) {
  v1::ErrorInfo info;
  info.set_reason("THEIRS");
  info.set_domain("example.com");
  v1::Status status;
  status.add_details()->set_type_url("type.googleapis.com/google.rpc.ErrorInfo");
  status.mutable_details(0)->set_value(info.SerializeAsString());

  EXPECT_EQ(decode_status_details(status.SerializeAsString())->reason, "");
}

TEST(StatusDetails, AreNothingWhenTheBytesAreNoStatus) {
  EXPECT_FALSE(decode_status_details("\xFF\xFF\xFF"));
}

}  // namespace
}  // namespace meshsmooth::wire

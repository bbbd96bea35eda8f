// Leases that nobody redeems, without sockets.
#include "transport/segment_leases.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

class SegmentLeasesTest : public ::testing::Test {
 protected:
  MemoryBudget budget_{MemoryBytes{1 << 30, {INT64_MAX}}};
  SegmentLeases leases_{budget_, {.max_bytes = 1 << 30, .max_bytes_per_caller = 0}};
};

TEST_F(SegmentLeasesTest, ThatAreNotRedeemedMakeRoomForOthers) {
  std::string last_of_a;
  for (int i = 0; i < 128; ++i) last_of_a = leases_.lease("anonymous", "a", 4096).ticket;
  EXPECT_THROW(static_cast<void>(leases_.lease("anonymous", "a", 4096)), Busy);
  std::vector<std::string> of_b;
  for (int i = 0; i < 30; ++i) of_b.push_back(leases_.lease("anonymous", "b", 4096).ticket);
  for (const std::string& ticket : of_b) EXPECT_NE(leases_.redeem(ticket), nullptr);
  EXPECT_NE(leases_.redeem(last_of_a), nullptr) << "the oldest give way";
}

TEST_F(SegmentLeasesTest, MakeRoomInBytesToo) {
  const std::string first = leases_.lease("anonymous", "a", 1 << 29).ticket;
  static_cast<void>(leases_.lease("anonymous", "a", 1 << 29));
  EXPECT_NO_THROW(static_cast<void>(leases_.lease("anonymous", "b", 4096)));
  EXPECT_EQ(leases_.redeem(first), nullptr);
}

TEST_F(SegmentLeasesTest, GiveMemoryToJobsOfOthers) {
  static_cast<void>(leases_.lease("anonymous", "a", 1 << 29));
  ASSERT_TRUE(leases_.redeem(leases_.lease("anonymous", "a", 1 << 20).ticket));
  static_cast<void>(leases_.lease("anonymous", "a", 1 << 28));
  const MemoryEstimate job{.host_bytes = 1 << 29};
  EXPECT_THROW(static_cast<void>(budget_.reserve(job)), OutOfMemory);
  EXPECT_FALSE(leases_.drop_unredeemed("a"));  // its own do not
  EXPECT_TRUE(leases_.drop_unredeemed("b"));
  EXPECT_NO_THROW(static_cast<void>(budget_.reserve(job)));
  EXPECT_EQ(leases_.bytes().leased, (1 << 20) + (1 << 28));  // the oldest, and no redeemed one
}

}  // namespace
}  // namespace meshsmooth::server

#include "rpc/call_limits.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

class CallLimitsTest : public ::testing::Test {
 protected:
  std::vector<std::string> cut_;
  CallLimits limits_{
      {.calls_per_connection = 3, .answer_bytes_per_connection = 100, .answer_bytes = 150},
      [this](const std::string& connection) { cut_.push_back(connection); }};
};

TEST_F(CallLimitsTest, RefuseTheCallsOfAConnectionThatHasTooMany) {
  std::vector<CallPlace> places;
  for (int i = 0; i < 3; ++i) places.push_back(limits_.take("a"));
  try {
    static_cast<void>(limits_.take("a"));
    FAIL() << "nothing thrown";
  } catch (const Busy& error) {
    EXPECT_EQ(error.reason(), "QUOTA_EXCEEDED");
    EXPECT_GT(error.retry_delay().count(), 0);
  }
  EXPECT_NO_THROW(static_cast<void>(limits_.take("b"))) << "another connection";
  places.pop_back();
  EXPECT_NO_THROW(static_cast<void>(limits_.take("a"))) << "one of them has ended";
}

TEST_F(CallLimitsTest, CutOffAConnectionThatGoesOn) {
  std::vector<CallPlace> places;
  for (int i = 0; i < 3; ++i) places.push_back(limits_.take("a"));
  for (int i = 0; i < 5; ++i) EXPECT_THROW(static_cast<void>(limits_.take("a")), Busy);
  EXPECT_EQ(cut_, std::vector<std::string>{"a"});
}

TEST_F(CallLimitsTest, DoNotCountTheCallsOfConnectionsThatCannotBeToldApart) {
  std::vector<CallPlace> places;
  for (int i = 0; i < 10; ++i) EXPECT_NO_THROW(places.push_back(limits_.take("")));
}

TEST_F(CallLimitsTest, BoundTheAnswersThatAConnectionHasNotRead) {
  CallPlace first = limits_.take("a"), second = limits_.take("a");
  first.hold_answer(60);
  EXPECT_THROW(second.hold_answer(60), Busy);
  EXPECT_NO_THROW(second.hold_answer(40));
  { const CallPlace ended = std::move(first); }
  CallPlace third = limits_.take("a");
  EXPECT_NO_THROW(third.hold_answer(60));
}

TEST_F(CallLimitsTest, BoundTheAnswersOfAllConnections) {
  CallPlace a = limits_.take("a"), b = limits_.take("b"), c = limits_.take("");
  a.hold_answer(90);
  EXPECT_THROW(b.hold_answer(70), Busy);
  EXPECT_NO_THROW(b.hold_answer(60));
  EXPECT_THROW(c.hold_answer(1), Busy);
}

TEST_F(CallLimitsTest, LetOneAnswerOfAnySizePass) {
  CallPlace only = limits_.take("a");
  EXPECT_NO_THROW(only.hold_answer(1000));
}

}  // namespace
}  // namespace meshsmooth::server

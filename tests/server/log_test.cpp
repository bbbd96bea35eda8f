#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "log.hpp"
#include "log_fields.hpp"
#include "meshsmooth/error.hpp"
#include "wire/traceparent.hpp"

namespace meshsmooth::server {
namespace {

TEST(LogFields, AreTextWithQuotesWhereNeeded) {
  EXPECT_EQ(to_text({{"event", "end"},
                     {"count", std::int64_t{3}},
                     {"seconds", 0.5},
                     {"right", true},
                     {"message", "a \"b\" = c"},
                     {"none", ""}}),
            R"(event=end count=3 seconds=0.5 right=true message="a \"b\" = c" none="")");
}

TEST(LogFields, AreJson) {
  EXPECT_EQ(to_json({{"event", "end"}, {"count", std::int64_t{3}}, {"right", false}}),
            R"("event":"end","count":3,"right":false)");
}

// Nothing that a caller sends makes a second line, or another field.
TEST(LogFields, EscapeWhatCallersMaySend) {
  const std::string evil = "x\n{\"event\":\"fake\"}\x1b[31m\xff\\";
  EXPECT_EQ(to_text({{"m", evil}}), R"(m="x\u000a{\"event\":\"fake\"}\u001b[31m\u00ff\\")");
  EXPECT_EQ(to_json({{"m", evil}}), R"("m":"x\u000a{\"event\":\"fake\"}\u001b[31m\u00ff\\")");
}

// Nobody fills the disk by calls that are refused.
TEST(Log, LimitsTheLinesOfDeniedCalls) {
  set_log("warn", "text");
  ::testing::internal::CaptureStderr();
  for (int i = 0; i < 1000; ++i)
    log_denied(Error("TOKEN_UNKNOWN", "unknown token"), "ipv4:1.2.3.4:5");
  const std::string lines = ::testing::internal::GetCapturedStderr();
  set_log("off", "text");
  const auto count = std::ranges::count(lines, '\n');
  EXPECT_GE(count, 10);
  EXPECT_LT(count, 500);
}

TEST(Traceparent, IsW3cs) {
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  const std::string parent = "00f067aa0ba902b7";
  EXPECT_TRUE(wire::is_traceparent("00-" + trace + "-" + parent + "-01"));
  EXPECT_TRUE(wire::is_traceparent("01-" + trace + "-" + parent + "-00"));
  EXPECT_TRUE(wire::is_traceparent("01-" + trace + "-" + parent + "-00-more"));

  EXPECT_FALSE(wire::is_traceparent(""));
  EXPECT_FALSE(wire::is_traceparent("00-" + trace + "-" + parent));
  EXPECT_FALSE(wire::is_traceparent("00-" + trace + "-" + parent + "-01-more"));
  EXPECT_FALSE(wire::is_traceparent("00-" + trace + "-" + parent + "-01 "));
  EXPECT_FALSE(wire::is_traceparent("01-" + trace + "-" + parent + "-01-a\nb"));
  EXPECT_FALSE(wire::is_traceparent("01-" + trace + "-" + parent + "-01more"));
  EXPECT_FALSE(wire::is_traceparent("01-" + trace + "-" + parent + "-01-" + std::string(100, 'x')));
  EXPECT_FALSE(wire::is_traceparent("ff-" + trace + "-" + parent + "-01"));
  EXPECT_FALSE(wire::is_traceparent("0g-" + trace + "-" + parent + "-01"));
  EXPECT_FALSE(wire::is_traceparent("00-" + trace + "-" + parent + "-0G"));
  EXPECT_FALSE(wire::is_traceparent("00-" + std::string(32, '0') + "-" + parent + "-01"));
  EXPECT_FALSE(wire::is_traceparent("00-" + trace + "-" + std::string(16, '0') + "-01"));
  EXPECT_FALSE(wire::is_traceparent("00_" + trace + "-" + parent + "-01"));
}

}  // namespace
}  // namespace meshsmooth::server

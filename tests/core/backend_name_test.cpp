#include "meshsmooth/backend_name.hpp"

#include <gtest/gtest.h>

#include "meshsmooth/job_state.hpp"

namespace meshsmooth {
namespace {

TEST(BackendName, IsPrintedAsItWasRead) {
  for (const char* text : {"auto", "cpu", "cuda", "cuda:0", "cuda:12"}) {
    const auto name = parse_backend_name(text);
    ASSERT_TRUE(name) << text;
    EXPECT_EQ(to_string(*name), text);
  }
  EXPECT_EQ(parse_backend_name("cuda:3")->kind, BackendKind::cuda);
  EXPECT_EQ(parse_backend_name("cuda:3")->device, 3);
  EXPECT_FALSE(parse_backend_name("cuda")->device);
}

TEST(BackendName, RefusesEverythingElse) {
  for (const char* text : {"", "abacus", "cud", "cuda:", "cuda:-1", "cuda:1x", "cuda: 1",
                           "cuda:1:2", "cuda1", "cpu:0", "auto:0", "CPU", "cuda:99999999999"}) {
    EXPECT_FALSE(parse_backend_name(text)) << text;
  }
}

TEST(JobState, HasANameAndAnEnd) {
  EXPECT_EQ(job_state_name(JobState::queued), "queued");
  EXPECT_EQ(job_state_name(JobState::expired), "expired");
  EXPECT_FALSE(has_ended(JobState::unspecified));
  EXPECT_FALSE(has_ended(JobState::sending));
  for (const JobState state :
       {JobState::succeeded, JobState::failed, JobState::cancelled, JobState::expired}) {
    EXPECT_TRUE(has_ended(state));
  }
}

}  // namespace
}  // namespace meshsmooth

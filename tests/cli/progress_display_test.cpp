#include "progress_display.hpp"

#include <gmock/gmock.h>

#include <sstream>

namespace meshsmooth::cli {
namespace {

using client::JobProgress;
using client::JobState;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ProgressDisplayTest : public ::testing::Test {
 protected:
  ProgressDisplay make(bool terminal) {
    return {out_, terminal, {.max_iterations = 1000, .tolerance = 1e-4}, [this] { return now_; }};
  }
  void wait(double seconds) {
    now_ += std::chrono::duration_cast<ProgressDisplay::Clock::duration>(
        std::chrono::duration<double>(seconds));
  }
  static JobProgress iterate(int iteration, double move) {
    return {.state = JobState::running,
            .stage = "iterate",
            .iteration = iteration,
            .max_displacement = move};
  }

  std::ostringstream out_;
  ProgressDisplay::Clock::time_point now_{};
};

TEST_F(ProgressDisplayTest, GivesAPipeOneLineAStageAndThenOneASecond) {
  ProgressDisplay display = make(false);

  display.show({.state = JobState::queued, .queue_position = 3, .stage = ""});
  display.show({.state = JobState::running, .stage = "find_neighbours"});
  display.show(iterate(1, 1.0));
  wait(0.5);
  display.show(iterate(11, 0.5));
  wait(0.5);
  display.show(iterate(21, 0.25));
  display.finish();

  EXPECT_EQ(out_.str(),
            "queued, place 3\n"
            "find neighbours\n"
            "iterate: iteration 1, largest move 1\n"
            "iterate: iteration 21, largest move 0.25, 20/s\n");
}

TEST_F(ProgressDisplayTest, DrawsOneLineAgainOnATerminalAndWipesItAtTheEnd) {
  ProgressDisplay display = make(true);

  display.show(iterate(1, 1.0));
  wait(1);
  display.show(iterate(3, 0.01));
  const std::string drawn = out_.str();
  display.finish();

  EXPECT_THAT(drawn, Not(HasSubstr("\n")));
  EXPECT_THAT(drawn, HasSubstr("\r\x1b[Kiterate   [............"));
  EXPECT_THAT(drawn, HasSubstr("iteration 3, largest move 0.01, 2/s"));
  EXPECT_THAT(out_.str(), ::testing::EndsWith("\r\x1b[K"));
}

TEST_F(ProgressDisplayTest, FillsTheBarByConvergenceOrByIterationsWhicheverIsFurther) {
  ProgressDisplay display = make(true);
  const auto bar_after = [&](const JobProgress& progress) {
    out_.str("");
    display.show(progress);
    return std::ranges::count(out_.str(), '#');
  };

  EXPECT_EQ(bar_after(iterate(1, 1.0)), 0);
  EXPECT_EQ(bar_after(iterate(2, 1e-2)), 12);  // half way in the logarithm
  EXPECT_EQ(bar_after(iterate(3, 1e-1)), 12);  // never goes back
  EXPECT_EQ(bar_after(iterate(750, 1e-2)), 18);
  EXPECT_EQ(bar_after(iterate(751, 1e-9)), 24);
}

TEST_F(ProgressDisplayTest, StaysSilentWithoutProgress) {
  make(true).finish();
  make(false).finish();

  EXPECT_EQ(out_.str(), "");
}

TEST_F(ProgressDisplayTest, GivesProgramsEachReportAsAnObjectInALine) {
  ProgressDisplay display(
      out_, true, {.max_iterations = 10, .tolerance = 0}, [this] { return now_; },
      ProgressDisplay::Form::json);
  display.show({.state = JobState::queued, .queue_position = 3, .stage = ""});
  display.show(iterate(5, 0.25));
  display.finish();
  EXPECT_EQ(out_.str(),
            "{\"progress\": {\"state\": \"queued\", \"stage\": \"\", \"queue_position\": 3, "
            "\"iteration\": 0, \"max_displacement\": 0, \"share_done\": 0}}\n"
            "{\"progress\": {\"state\": \"running\", \"stage\": \"iterate\", "
            "\"queue_position\": 0, \"iteration\": 5, \"max_displacement\": 0.25, "
            "\"share_done\": 0.5}}\n");
}

}  // namespace
}  // namespace meshsmooth::cli

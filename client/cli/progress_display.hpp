#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

/// Shows how a job gets on: one line that is drawn again on a terminal; plain
/// lines elsewhere, at every new stage and then at most one a second.
class ProgressDisplay {
 public:
  using Clock = std::chrono::steady_clock;

  /// When a job is done: iterations at most, or moves below `tolerance` (in the
  /// mesh's unit).
  struct Goal {
    int max_iterations = 0;
    double tolerance = 0;
  };

  /// For people: as above; for programs: each report as a JSON object in a line.
  enum class Form { text, json };

  ProgressDisplay(std::ostream& out, bool terminal, Goal goal,
                  std::function<Clock::time_point()> now = Clock::now, Form form = Form::text)
      : out_(out),
        terminal_(terminal && form == Form::text),
        form_(form),
        goal_(goal),
        now_(std::move(now)) {}

  void show(const client::JobProgress& progress);
  /// Wipes the line off the terminal.
  void finish();

 private:
  [[nodiscard]] std::string describe(const client::JobProgress& progress) const;
  [[nodiscard]] std::string to_json(const client::JobProgress& progress) const;
  [[nodiscard]] std::string bar() const;
  void follow(const client::JobProgress& progress, Clock::time_point now);

  std::ostream& out_;
  bool terminal_;
  Form form_;
  Goal goal_;
  std::function<Clock::time_point()> now_;
  std::string phase_;  // what the last line was about
  std::optional<Clock::time_point> last_line_;
  std::optional<Clock::time_point> first_time_;  // of the first iteration seen
  int first_iteration_ = 0;
  double first_displacement_ = 0;
  double iterations_per_second_ = 0;
  double share_done_ = 0;
};

}  // namespace meshsmooth::cli

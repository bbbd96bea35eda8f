#include "progress_display.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/encoding.hpp"

namespace meshsmooth::cli {
namespace {

constexpr int kBarWidth = 24;

std::string phase_of(const client::JobProgress& progress) {
  if (progress.state == client::JobState::running && !progress.stage.empty()) {
    std::string stage = progress.stage;
    std::replace(stage.begin(), stage.end(), '_', ' ');
    return stage;
  }
  return std::string(client::job_state_name(progress.state));
}

/// Moves shrink geometrically, so the logarithm is what runs evenly.
double share_of_convergence(double first, double current, double tolerance) {
  if (!(tolerance > 0) || !(current > 0) || !(first > tolerance)) return 0;
  return std::log(first / current) / std::log(first / tolerance);
}

}  // namespace

void ProgressDisplay::show(const client::JobProgress& progress) {
  const Clock::time_point now = now_();
  follow(progress, now);
  const std::string phase = phase_of(progress);
  if (form_ == Form::json) {
    out_ << to_json(progress) << std::endl;
  } else if (terminal_) {
    out_ << "\r\x1b[K" << describe(progress) << std::flush;
  } else if (phase != phase_ || !last_line_ || now - *last_line_ >= std::chrono::seconds(1)) {
    out_ << describe(progress) << std::endl;
    last_line_ = now;
  }
  phase_ = phase;
}

void ProgressDisplay::finish() {
  if (terminal_ && !phase_.empty()) out_ << "\r\x1b[K" << std::flush;
}

void ProgressDisplay::follow(const client::JobProgress& progress, Clock::time_point now) {
  if (progress.iteration <= 0) return;
  if (!first_time_) {
    first_time_ = now;
    first_iteration_ = progress.iteration;
    first_displacement_ = progress.max_displacement;
  }
  const double seconds = std::chrono::duration<double>(now - *first_time_).count();
  if (seconds > 0) iterations_per_second_ = (progress.iteration - first_iteration_) / seconds;
  const double of_limit =
      goal_.max_iterations > 0 ? double(progress.iteration) / goal_.max_iterations : 0;
  const double of_convergence =
      share_of_convergence(first_displacement_, progress.max_displacement, goal_.tolerance);
  share_done_ = std::clamp(std::max(of_limit, of_convergence), share_done_, 1.0);
}

std::string ProgressDisplay::describe(const client::JobProgress& progress) const {
  std::string line = phase_of(progress);
  if (progress.state == client::JobState::queued && progress.queue_position > 0) {
    return line + fmt::format(", place {}", progress.queue_position);
  }
  if (progress.iteration <= 0) return line;
  if (terminal_) line = fmt::format("{:<9} {}", line, bar());
  line += fmt::format("{} iteration {}, largest move {:.3g}", terminal_ ? "" : ":",
                      progress.iteration, progress.max_displacement);
  if (iterations_per_second_ > 0) line += fmt::format(", {:.3g}/s", iterations_per_second_);
  return line;
}

std::string ProgressDisplay::to_json(const client::JobProgress& progress) const {
  return fmt::format(
      "{{\"progress\": {{\"state\": {}, \"stage\": {}, \"queue_position\": {}, "
      "\"iteration\": {}, \"max_displacement\": {}, \"share_done\": {}}}}}",
      json_string(client::job_state_name(progress.state)), json_string(progress.stage),
      progress.queue_position, progress.iteration, json_number(progress.max_displacement),
      json_number(share_done_));
}

std::string ProgressDisplay::bar() const {
  const int filled = static_cast<int>(share_done_ * kBarWidth);
  return fmt::format("[{:#<{}}{:.<{}}]", "", filled, "", kBarWidth - filled);
}

}  // namespace meshsmooth::cli

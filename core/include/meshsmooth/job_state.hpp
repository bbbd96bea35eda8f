#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace meshsmooth {

/// The state of a job. The numbers are those of meshsmooth.v1.State.
enum class JobState {
  unspecified,  // of no job; a state that a newer server reports
  receiving,
  queued,
  running,
  sending,
  succeeded,
  failed,
  cancelled,
  expired,  // it succeeded, and its result was kept; the result is gone
};

inline constexpr std::array<std::string_view, 9> kJobStateNames = {
    "unspecified", "receiving", "queued",    "running", "sending",
    "succeeded",   "failed",    "cancelled", "expired"};

/// "receiving", "queued" …
[[nodiscard]] constexpr std::string_view job_state_name(JobState state) {
  return kJobStateNames[static_cast<std::size_t>(state)];
}

/// Whether a job in this state never leaves it, but for `expired`.
[[nodiscard]] constexpr bool has_ended(JobState state) { return state >= JobState::succeeded; }

}  // namespace meshsmooth

#pragma once

#include <string_view>

#include "meshsmooth/enums.hpp"

namespace meshsmooth {

/// "receiving", "queued" …
[[nodiscard]] constexpr std::string_view job_state_name(JobState state) { return enum_name(state); }

/// Whether a job in this state never leaves it, but for `expired`.
[[nodiscard]] constexpr bool has_ended(JobState state) { return state >= JobState::succeeded; }

}  // namespace meshsmooth

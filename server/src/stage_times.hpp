#pragma once

#include <array>
#include <utility>

#include "meshsmooth/summary.hpp"

namespace meshsmooth::server {

/// The stages of the pipeline by the names of metrics and spans, in their order.
inline constexpr auto kStageTimes = std::to_array<std::pair<const char*, double StageTimes::*>>(
    {{"upload", &StageTimes::upload_seconds},
     {"find_neighbours", &StageTimes::find_neighbours_seconds},
     {"find_boundary", &StageTimes::find_boundary_seconds},
     {"iterate", &StageTimes::iterate_seconds},
     {"evaluate", &StageTimes::evaluate_seconds},
     {"download", &StageTimes::download_seconds}});

}  // namespace meshsmooth::server

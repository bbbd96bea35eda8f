#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "meshsmooth/quality.hpp"

namespace meshsmooth::cli {

/// Every metric with its histogram, what is inverted or degenerate, and the
/// worst elements under the names the file gives them.
[[nodiscard]] std::string describe_quality(
    const QualityStats& stats, const std::function<std::int64_t(std::int64_t)>& file_element_id);

}  // namespace meshsmooth::cli

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "meshsmooth/quality.hpp"

namespace meshsmooth::cli {

/// One character a bin; any element at all shows.
[[nodiscard]] std::string draw_histogram(const std::vector<std::int64_t>& bins);

/// Every metric with its histogram, what is inverted or degenerate, and the
/// worst elements under the names the file gives them.
[[nodiscard]] std::string describe_quality(
    const QualityStats& stats, const std::function<std::int64_t(std::int64_t)>& file_element_id);

}  // namespace meshsmooth::cli

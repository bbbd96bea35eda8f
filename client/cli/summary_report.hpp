#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "meshsmooth/client.hpp"

namespace meshsmooth::cli {

/// What a smoothed mesh's user wants to know, in a screenful. `file_element_id`
/// turns an element id of the mesh into what the file calls it.
[[nodiscard]] std::string describe_summary(
    const client::SmoothReport& report, const SmoothOptions& options, double total_seconds,
    const std::function<std::int64_t(std::int64_t)>& file_element_id);

/// The same without the table and the histograms: a sentence a line.
[[nodiscard]] std::string describe_findings(
    const client::SmoothReport& report, const SmoothOptions& options, double total_seconds,
    const std::function<std::int64_t(std::int64_t)>& file_element_id);

/// One sentence about inverted elements after and before.
[[nodiscard]] std::string describe_inverted(const SmoothSummary& summary,
                                            const SmoothOptions& options);

}  // namespace meshsmooth::cli

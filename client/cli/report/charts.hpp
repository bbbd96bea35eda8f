#pragma once

#include <span>
#include <string>

#include "meshsmooth/summary.hpp"

namespace meshsmooth::cli {

/// The histograms of a metric as an SVG image; `before` may be null.
[[nodiscard]] std::string histogram_svg(const MetricStats* before, const MetricStats& metric);

/// What a job recorded of each sweep, as SVG images with their captions; "" without a history.
[[nodiscard]] std::string history_figures(const Convergence& convergence);

}  // namespace meshsmooth::cli

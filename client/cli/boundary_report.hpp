#pragma once

#include <optional>
#include <string>

#include "meshsmooth/summary.hpp"

namespace meshsmooth::cli {

/// The volume of the elements against the enclosed one, for elements that overlap; "" for surfaces.
[[nodiscard]] std::string describe_volume(const QualityStats& stats);

/// What sliding on curved parts made of the boundary, or of a surface.
[[nodiscard]] std::string describe_deviation(const SmoothSummary& summary);

/// How far the boundary came onto a target surface; "" without one.
[[nodiscard]] std::string describe_fit(const std::optional<FitStats>& fit);

}  // namespace meshsmooth::cli

#pragma once

#include <algorithm>
#include <cmath>

namespace meshsmooth::test {

/// Of metrics of elements, whether two backends may tell both: roots and angles come from another
/// library on a device, and the last bits differ. Angles near 0 and 180 degrees are
/// ill-conditioned.
[[nodiscard]] inline bool close_or_both_nan(float told, float truth) {
  if (std::isnan(told) || std::isnan(truth)) return std::isnan(told) && std::isnan(truth);
  return std::abs(told - truth) <= 2e-6F * std::max(1.0F, std::abs(truth));
}

}  // namespace meshsmooth::test

#pragma once

#include "meshsmooth/summary.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::wire {

/// How far the boundary came onto a target surface.
void encode_fit(const FitStats& fit, v1::FitStats* message);
[[nodiscard]] FitStats decode_fit(const v1::FitStats& message);

}  // namespace meshsmooth::wire

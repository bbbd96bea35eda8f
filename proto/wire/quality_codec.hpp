#pragma once

#include "meshsmooth/quality.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::wire {

void encode_element_quality(const ElementQuality& quality, v1::ElementQuality* message);
/// Throws NotSupported (OPTION_NOT_SUPPORTED) for an unknown type of element.
[[nodiscard]] ElementQuality decode_element_quality(const v1::ElementQuality& message);

void encode_quality(const QualityStats& stats, v1::QualityStats* message);
/// Leaves out metrics that a newer server added.
[[nodiscard]] QualityStats decode_quality(const v1::QualityStats& message);

}  // namespace meshsmooth::wire

#pragma once

#include <vector>

#include "meshsmooth/shape_metrics.hpp"

namespace meshsmooth::detail {

/// Metrics of the faces of a volume mesh, as `tabulate_elements` describes them.
struct FaceMetrics {
  std::vector<double> non_orthogonality;  // [element_count]; NaN where an element shares no face
  std::vector<double> skewness;           // [element_count]
  FaceStats stats;
};

[[nodiscard]] FaceMetrics measure_faces(const TopologyView& topology,
                                        const PositionsView& positions);

}  // namespace meshsmooth::detail

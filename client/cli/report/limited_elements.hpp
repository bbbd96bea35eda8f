#pragma once

#include <cstdint>
#include <span>

#include "meshsmooth/options.hpp"
#include "report/shown_elements.hpp"

namespace meshsmooth::cli {

/// Marks the shown elements that `PoorElements::limited_count` counts. Each poor one is tried by a
/// job of one sweep on the balls of its nodes, where nothing else may move: about 0.4 ms each.
///
/// @param fixed [node_count], non-zero = fixed
/// @returns false, and marks nothing, where the energy of a ball depends on more than its result:
///          on boxes, a reference, the input's positions or surface; or where it is not known here
///          which nodes may move. `options.report_below` must be set.
bool mark_limited(const DrawnMesh& mesh, std::span<ShownElement> elements,
                  const SmoothOptions& options, std::span<const std::uint8_t> fixed);

}  // namespace meshsmooth::cli

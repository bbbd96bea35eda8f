#pragma once

#include <span>
#include <string>

#include "content.hpp"

namespace meshsmooth::formats {

/// The segment's text with other coordinates in the fields of those that changed. `positions`: by
/// node, as they stand in the text. O(text).
[[nodiscard]] std::string replace_nastran_coordinates(const TextSegment& segment,
                                                      std::span<const Vec3d> positions);

}  // namespace meshsmooth::formats

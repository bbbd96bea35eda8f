#pragma once

#include <cstdint>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// Throws the nodes marked in `movable` about, by just so much that about
/// `share` of the elements is inverted; 0 changes nothing. In a plane mesh
/// they stay in the plane z = 0. Throws `InvalidOption` unless
/// 0 <= share <= 0.45: thrown nodes cannot invert more than about half.
void tangle(Mesh& mesh, const std::vector<std::uint8_t>& movable, double share, std::uint64_t seed);

/// Throws `InvalidOption` (OPTION_OUT_OF_RANGE) unless `share` is in range.
void check_tangle(double share);

}  // namespace meshsmooth::formats

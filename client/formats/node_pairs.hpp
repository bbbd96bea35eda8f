#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::formats {

/// Nodes that belong to each other on two sides of a mesh, called by their names in errors.
struct Side {
  std::string name;
  std::span<const NodeId> nodes;  // each once
};

/// The pairs of two sides one of which a translation or a rotation, about whatever axis, brings to
/// the other; it is found by the positions, to 1e-5 of the diagonal of the larger side's bounding
/// box. Translations come first, then rotations without a part along their axis, by the angle. A
/// node on both sides, as on the axis, is its own partner. `field`: the
/// option, for errors. Throws `InvalidOption` (PERIODIC_MISMATCH) where the sides have different
/// numbers of nodes, or none, or do not match; it names the node of `a` that is, translated,
/// farthest from those of `b`. O(n^1.5) on sides that are sheets of n nodes.
[[nodiscard]] std::vector<NodePair> match_sides(const PositionsView& positions, const Side& a,
                                                const Side& b, const std::string& field);

}  // namespace meshsmooth::formats

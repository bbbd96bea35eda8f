#pragma once

#include <utility>

#include "meshsmooth/numbering.hpp"

namespace meshsmooth::detail {

/// Ends a job on a mesh that has mirrored elements: it begins anew on a `ConsistentTopology`. No
/// error, so it is none of the caller's exceptions.
struct MirroredElements {
  Numbering numbering;
};

/// Throws `MirroredElements` where there are some in a topology not known to be consistent.
/// O(elements log star size).
inline void throw_mirrored(const TopologyView& topology, const PositionsView& positions) {
  if (topology.consistent) return;
  Numbering numbering = find_numbering(topology, positions);
  if (numbering.mirrored_count > 0) throw MirroredElements{std::move(numbering)};
}

}  // namespace meshsmooth::detail

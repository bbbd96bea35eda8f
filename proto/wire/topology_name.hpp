#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "meshsmooth/mesh.hpp"
#include "wire/mesh_layout.hpp"
#include "wire/sha256.hpp"

namespace meshsmooth::wire {

/// The name of a topology by its content, "topologies/sha256-…", as
/// meshsmooth.v1.Topology says: of the sizes, then of the arrays as they are sent.
class TopologyNamer {
 public:
  explicit TopologyNamer(const MeshLayout& layout);

  /// Elements, fixed mask, element regions, kept reference: in this order, in pieces of any size.
  void add(std::span<const std::byte> bytes) { hash_.add(bytes); }
  /// Once.
  [[nodiscard]] std::string finish() { return "topologies/sha256-" + hash_.finish(); }

 private:
  Sha256 hash_;
};

/// Of a mesh in memory; `reference`: kept with it, or empty. O(bytes).
[[nodiscard]] std::string topology_name(const TopologyView& topology,
                                        const PositionsView& reference = {});

}  // namespace meshsmooth::wire

#pragma once

#include <cstdint>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// The nodes of a mesh by their positions: of those that share one, the lowest stands for all.
/// Positions are the same if all their digits are; those that are not finite are left alone.
class CoincidentNodes {
 public:
  /// O(nodes * log nodes).
  explicit CoincidentNodes(const PositionsView& positions);

  /// How many nodes others stand for.
  [[nodiscard]] std::int64_t merged_count() const { return merged_count_; }
  /// The node that stands for a node; of nodes that do not exist themselves.
  [[nodiscard]] NodeId representative(NodeId node) const;

  /// Has the elements use the nodes that stand for theirs, so that the others are in no element; a
  /// node that stands for a fixed one is fixed. The number of nodes stays. O(nodes of elements).
  void merge(Mesh& mesh) const;
  /// Moves each node to the one that stands for it. O(nodes).
  void spread(Mesh& mesh) const;

 private:
  std::vector<NodeId> representative_;
  std::int64_t merged_count_ = 0;
};

}  // namespace meshsmooth::formats

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::detail {

/// A mesh of second order as the linear mesh of its corners, and what lies in the middle of their
/// edges, faces and elements. Corners, and nodes in no element, keep their order; elements keep
/// their ids.
class CornerMesh {
 public:
  /// A node and the corners in whose middle it lies.
  struct Mid {
    NodeId node;                      // the caller's id
    std::span<const NodeId> corners;  // ids of the linear mesh, ascending
  };

  /// O(elements + nodes). The topology must be valid.
  /// @throws InvalidMesh MID_NODE_MISPLACED
  explicit CornerMesh(const TopologyView& topology);

  /// @returns the linear mesh; this object owns its arrays
  [[nodiscard]] TopologyView view() const;
  /// @returns the caller's ids of its nodes, ascending
  [[nodiscard]] std::span<const NodeId> nodes() const { return nodes_; }
  /// @returns the linear mesh's id of a node of the caller's; -1: it lies in the middle of others
  [[nodiscard]] NodeId corner_of(NodeId node) const {
    return corner_of_[static_cast<std::size_t>(node)];
  }
  [[nodiscard]] std::size_t mid_count() const { return mids_.size(); }
  [[nodiscard]] Mid mid(std::size_t index) const {
    const std::size_t begin = first_corner_[index];
    return {mids_[index], std::span(corners_).subspan(begin, first_corner_[index + 1] - begin)};
  }
  /// @returns the bytes that it owns
  [[nodiscard]] std::int64_t bytes() const;

  /// @returns the size of the linear mesh that one of this size has, its nodes an upper bound for a
  /// conforming mesh; of a linear mesh itself
  [[nodiscard]] static MeshSize size_of(const MeshSize& size);
  /// @returns an upper bound of `bytes` for a conforming mesh of this size; 0 for a linear one
  [[nodiscard]] static std::int64_t estimate_bytes(const MeshSize& size);

 private:
  void mark_corners(const TopologyView& topology);
  void find_mids(const TopologyView& topology);
  void add_mid(std::size_t element, ElementType type, std::span<const NodeId> nodes,
               const MidNode& place, NodeId node);
  void number_corners(const TopologyView& topology);

  std::vector<NodeId> nodes_;
  std::vector<NodeId> corner_of_;
  std::vector<ElementBlock> blocks_;
  std::vector<ElementBlockView> views_;
  std::vector<std::uint8_t> fixed_;
  std::span<const std::int32_t> regions_;
  bool canonical_;
  std::vector<NodeId> mids_;
  std::vector<std::size_t> first_corner_ = {0};
  std::vector<NodeId> corners_;
};

[[nodiscard]] bool is_second_order(const TopologyView& topology);
[[nodiscard]] bool is_second_order(const MeshSize& size);

/// The positions of the corners.
template <class Real>
[[nodiscard]] std::vector<Vec3<Real>> gather(std::span<const Vec3<Real>> positions,
                                             const CornerMesh& mesh) {
  std::vector<Vec3<Real>> corners;
  corners.reserve(mesh.nodes().size());
  for (const NodeId node : mesh.nodes()) {
    corners.push_back(positions[static_cast<std::size_t>(node)]);
  }
  return corners;
}

}  // namespace meshsmooth::detail

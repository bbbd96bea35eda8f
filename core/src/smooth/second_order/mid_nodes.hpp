#pragma once

#include <span>
#include <vector>

#include "smooth/second_order/corner_mesh.hpp"

namespace meshsmooth::detail {

/// Takes the nodes in the middle of edges, faces and elements along with their corners.
template <class Real>
class MidNodes {
 public:
  using Positions = std::span<const Vec3<Real>>;

  /// What it is given must outlive it. O(nodes).
  ///
  /// @param before       the caller's positions
  /// @param orientation  of `before`
  MidNodes(const TopologyView& topology, const CornerMesh& corners, Positions before,
           const SurfaceOrientation& orientation);

  /// @returns whether a node does not lie exactly in the middle of its corners, to the rounding of
  /// the coordinates
  [[nodiscard]] bool any_curved() const { return curved_count_ > 0; }
  /// @returns the corners of curved edges, faces and elements, ids of the linear mesh, ascending
  [[nodiscard]] std::vector<NodeId> corners_of_curved() const;

  /// Places all nodes by the new positions of the linear mesh's: those that lay in the middle of
  /// their corners do so exactly, the others follow by the mean of their corners' moves; fixed
  /// nodes, and those whose corners stay, keep their bits.
  void place(Positions corners, std::vector<Vec3<Real>>& after) const;

  /// The same, but corners of elements that would become invalid go back to where they were, until
  /// each element that was valid is.
  /// @returns how many corners went back
  std::int64_t place_validly(std::vector<Vec3<Real>>& corners,
                             std::vector<Vec3<Real>>& after) const;

  /// @returns whether each element that was valid is so in `after`
  [[nodiscard]] bool stays_valid(Positions after) const;

 private:
  template <class Visit>
  void visit_spoilt(Positions after, const Visit& visit) const;

  const TopologyView& topology_;
  const CornerMesh& corners_;
  Positions before_;
  const SurfaceOrientation& orientation_;
  std::vector<std::uint8_t> curved_;  // by index of `CornerMesh::mid`
  std::int64_t curved_count_ = 0;
};

}  // namespace meshsmooth::detail

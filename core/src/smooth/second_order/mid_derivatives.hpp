#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "meshsmooth/options.hpp"
#include "smooth/second_order/corner_mesh.hpp"
#include "smooth/second_order/prescribed_parts.hpp"

namespace meshsmooth::detail {

/// Tangents and cotangents of a mesh of second order from those of its corners: a node in the
/// middle moves by the mean of its corners' moves, unless it is fixed or prescribed itself.
template <class Real>
class MidDerivatives {
 public:
  /// What it is given must outlive it. With cotangents it adds up those of the corners.
  /// O(nodes); bytes as `estimate_bytes`.
  MidDerivatives(const TopologyView& topology, const CornerMesh& mesh, const JobInput& input);

  /// @returns what the linear mesh's job is given; this object owns its arrays
  [[nodiscard]] JobInput of_corners() const;

  /// Stores the result at all nodes for that of the corners. It may lie where the cotangents did.
  void place(std::span<const Vec3<Real>> corners, std::span<Vec3<Real>> result) const;

  /// @returns the bytes that it and its prescribed parts own at most
  [[nodiscard]] static std::int64_t estimate_bytes(std::int64_t node_count);

 private:
  [[nodiscard]] bool reverse() const { return position_count(input_.cotangent) > 0; }

  const CornerMesh& mesh_;
  const JobInput& input_;
  PrescribedParts<Real> prescribed_;   // of cotangents with those of nodes in the middle
  std::vector<std::uint8_t> follows_;  // by node: in the middle, neither fixed nor prescribed
  std::vector<Vec3d> cotangents_;      // of the corners
};

}  // namespace meshsmooth::detail

#pragma once

#include <variant>
#include <vector>

#include "meshsmooth/options.hpp"
#include "smooth/second_order/corner_mesh.hpp"

namespace meshsmooth::detail {

/// A share of the way from one position to another.
template <class Real>
[[nodiscard]] Vec3<Real> towards(Vec3<Real> from, Vec3<Real> to, double share) {
  const auto start = vec3_cast<double>(from);
  return vec3_cast<Real>(start + share * (vec3_cast<double>(to) - start));
}

/// The prescribed nodes of a job by what they are, with their positions or tangents; 0 without.
template <class Real>
struct PrescribedParts {
  std::vector<NodeId> corners;  // of the linear mesh
  std::vector<Vec3<Real>> corner_positions;
  std::vector<NodeId> mids;  // the caller's ids
  std::vector<Vec3<Real>> mid_positions;

  PrescribedParts(const PrescribedNodes& given, const CornerMesh& mesh) {
    std::visit(
        [&](const auto& positions) {
          for (std::size_t n = 0; n < given.nodes.size(); ++n) {
            const NodeId corner = mesh.corner_of(given.nodes[n]);
            const auto to = positions.empty() ? Vec3<Real>{} : vec3_cast<Real>(positions[n]);
            (corner >= 0 ? corners : mids).push_back(corner >= 0 ? corner : given.nodes[n]);
            (corner >= 0 ? corner_positions : mid_positions).push_back(to);
          }
        },
        given.positions);
  }
};

}  // namespace meshsmooth::detail

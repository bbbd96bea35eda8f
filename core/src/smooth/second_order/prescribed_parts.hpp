#pragma once

#include <variant>
#include <vector>

#include "meshsmooth/options.hpp"
#include "smooth/second_order/corner_mesh.hpp"

namespace meshsmooth::detail {

/// The prescribed nodes of a job by what they are.
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
            const auto to = vec3_cast<Real>(positions[n]);
            (corner >= 0 ? corners : mids).push_back(corner >= 0 ? corner : given.nodes[n]);
            (corner >= 0 ? corner_positions : mid_positions).push_back(to);
          }
        },
        given.positions);
  }
};

}  // namespace meshsmooth::detail

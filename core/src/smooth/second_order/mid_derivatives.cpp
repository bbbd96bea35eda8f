#include "smooth/second_order/mid_derivatives.hpp"

#include <algorithm>

namespace meshsmooth::detail {
namespace {

/// Calls `visit(mid, share)` for each node that follows, with the share of each of its corners.
template <class Visit>
void for_each_following(const CornerMesh& mesh, std::span<const std::uint8_t> follows,
                        const Visit& visit) {
  for (std::size_t m = 0; m < mesh.mid_count(); ++m) {
    const CornerMesh::Mid mid = mesh.mid(m);
    if (follows[static_cast<std::size_t>(mid.node)] == 0) continue;
    visit(mid, 1.0 / static_cast<double>(mid.corners.size()));
  }
}

}  // namespace

template <class Real>
MidDerivatives<Real>::MidDerivatives(const TopologyView& topology, const CornerMesh& mesh,
                                     const JobInput& input)
    : mesh_(mesh), input_(input), prescribed_(input.prescribed, mesh) {
  follows_.assign(topology.node_count, 1);
  for (std::size_t n = 0; n < topology.fixed.size(); ++n) follows_[n] = topology.fixed[n] == 0;
  for (const NodeId node : prescribed_.mids) follows_[static_cast<std::size_t>(node)] = 0;
  if (!reverse()) return;
  std::visit(
      [&](const auto& given) {
        cotangents_.reserve(mesh.nodes().size());
        for (const NodeId node : mesh.nodes()) {
          cotangents_.push_back(vec3_cast<double>(given[static_cast<std::size_t>(node)]));
        }
        for (std::size_t n = 0; n < prescribed_.mids.size(); ++n) {
          const auto node = static_cast<std::size_t>(prescribed_.mids[n]);
          prescribed_.mid_positions[n] = vec3_cast<Real>(given[node]);
        }
        for_each_following(mesh_, follows_, [&](const CornerMesh::Mid& mid, double share) {
          const auto own = vec3_cast<double>(given[static_cast<std::size_t>(mid.node)]);
          for (const NodeId corner : mid.corners) {
            cotangents_[static_cast<std::size_t>(corner)] += share * own;
          }
        });
      },
      input_.cotangent);
}

template <class Real>
JobInput MidDerivatives<Real>::of_corners() const {
  JobInput input;
  input.prescribed.nodes = prescribed_.corners;
  if (reverse()) {
    input.cotangent = std::span<const Vec3d>(cotangents_);
  } else {
    input.prescribed.positions = std::span<const Vec3<Real>>(prescribed_.corner_positions);
  }
  return input;
}

template <class Real>
void MidDerivatives<Real>::place(std::span<const Vec3<Real>> corners,
                                 std::span<Vec3<Real>> result) const {
  std::ranges::fill(result, Vec3<Real>{0, 0, 0});
  for (std::size_t c = 0; c < corners.size(); ++c) {
    result[static_cast<std::size_t>(mesh_.nodes()[c])] = corners[c];
  }
  for (std::size_t n = 0; n < prescribed_.mids.size(); ++n) {
    result[static_cast<std::size_t>(prescribed_.mids[n])] = prescribed_.mid_positions[n];
  }
  if (reverse()) return;
  for_each_following(mesh_, follows_, [&](const CornerMesh::Mid& mid, double share) {
    Vec3d sum{0, 0, 0};
    for (const NodeId corner : mid.corners) {
      sum += vec3_cast<double>(corners[static_cast<std::size_t>(corner)]);
    }
    result[static_cast<std::size_t>(mid.node)] = vec3_cast<Real>(share * sum);
  });
}

template <class Real>
std::int64_t MidDerivatives<Real>::estimate_bytes(std::int64_t node_count) {
  constexpr std::int64_t kPrescribed = sizeof(NodeId) + sizeof(Vec3<Real>);
  return node_count * (1 + kPrescribed + static_cast<std::int64_t>(sizeof(Vec3d)));
}

template class MidDerivatives<float>;
template class MidDerivatives<double>;

}  // namespace meshsmooth::detail

#include "smooth/second_order/mid_nodes.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "mesh/curved_jacobian.hpp"
#include "mesh/parallel.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {
namespace {

/// The mean of positions; of two it is rounded once.
template <class Real, class At>
Vec3<Real> mean_of(std::span<const NodeId> corners, const At& at) {
  if (corners.size() == 2) return Real(0.5) * (at(corners[0]) + at(corners[1]));
  Vec3d sum{0, 0, 0};
  for (const NodeId corner : corners) sum += vec3_cast<double>(at(corner));
  return vec3_cast<Real>((1.0 / static_cast<double>(corners.size())) * sum);
}

}  // namespace

template <class Real>
MidNodes<Real>::MidNodes(const TopologyView& topology, const CornerMesh& corners, Positions before,
                         const SurfaceOrientation& orientation)
    : topology_(topology), corners_(corners), before_(before), orientation_(orientation) {
  curved_.resize(corners.mid_count());
  const auto at = [&](NodeId corner) {
    return before_[static_cast<std::size_t>(corners_.nodes()[static_cast<std::size_t>(corner)])];
  };
  parallel_for_ranges(curved_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      const CornerMesh::Mid mid = corners_.mid(m);
      Real size = 0;
      for (const NodeId corner : mid.corners) {
        const Vec3<Real> p = at(corner);
        size = std::max({size, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
      }
      const Vec3<Real> away =
          before_[static_cast<std::size_t>(mid.node)] - mean_of<Real>(mid.corners, at);
      const Real most = 4 * std::numeric_limits<Real>::epsilon() * size;
      const Real largest = std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)});
      curved_[m] = largest > most ? 1 : 0;
    }
  });
  curved_count_ = std::count(curved_.begin(), curved_.end(), 1);
}

template <class Real>
std::vector<NodeId> MidNodes<Real>::corners_of_curved() const {
  std::vector<NodeId> result;
  for (std::size_t m = 0; m < curved_.size(); ++m) {
    if (curved_[m] == 0) continue;
    const auto corners = corners_.mid(m).corners;
    result.insert(result.end(), corners.begin(), corners.end());
  }
  std::ranges::sort(result);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

template <class Real>
void MidNodes<Real>::place(Positions corners, std::vector<Vec3<Real>>& after) const {
  after.assign(before_.begin(), before_.end());
  const std::span<const NodeId> nodes = corners_.nodes();
  parallel_for_ranges(nodes.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      after[static_cast<std::size_t>(nodes[c])] = corners[c];
  });
  const auto at = [&](NodeId corner) { return corners[static_cast<std::size_t>(corner)]; };
  const auto move = [&](NodeId corner) {
    const auto from = before_[static_cast<std::size_t>(nodes[static_cast<std::size_t>(corner)])];
    return vec3_cast<double>(at(corner)) - vec3_cast<double>(from);
  };
  parallel_for_ranges(curved_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      const CornerMesh::Mid mid = corners_.mid(m);
      const auto node = static_cast<std::size_t>(mid.node);
      if (!topology_.fixed.empty() && topology_.fixed[node] != 0) continue;
      const bool moves = std::ranges::any_of(mid.corners, [&](NodeId corner) {
        return !(move(corner) == Vec3d{0, 0, 0});
      });
      if (!moves) continue;
      after[node] = curved_[m] == 0 ? mean_of<Real>(mid.corners, at)
                                    : vec3_cast<Real>(vec3_cast<double>(before_[node]) +
                                                      mean_of<double>(mid.corners, move));
    }
  });
}

template <class Real>
template <class Visit>
void MidNodes<Real>::visit_spoilt(Positions after, const Visit& visit) const {
  for_each_element(topology_,
                   [&](ElementType type, std::span<const NodeId> nodes, std::size_t element) {
                     const bool moves = std::ranges::any_of(nodes, [&](NodeId node) {
                       const auto n = static_cast<std::size_t>(node);
                       return !(after[n] == before_[n]);
                     });
                     if (!moves) return;
                     const Vec3d reference = orientation_.reference(element);
                     const auto is_valid_in = [&](Positions positions) {
                       return is_valid(type, positions_of(nodes, positions).data(), reference);
                     };
                     if (!is_valid_in(after) && is_valid_in(before_)) visit(nodes);
                   });
}

template <class Real>
std::int64_t MidNodes<Real>::place_validly(std::vector<Vec3<Real>>& corners,
                                           std::vector<Vec3<Real>>& after) const {
  std::vector<std::uint8_t> back(corners.size());
  while (true) {
    place(corners, after);
    std::atomic<bool> spoilt = false;
    visit_spoilt(after, [&](std::span<const NodeId> nodes) {
      for (const NodeId node : nodes) {
        const NodeId corner = corners_.corner_of(node);
        if (corner < 0) continue;
        std::atomic_ref(back[static_cast<std::size_t>(corner)]).store(1, std::memory_order_relaxed);
      }
      spoilt.store(true, std::memory_order_relaxed);
    });
    if (!spoilt) return std::count(back.begin(), back.end(), 1);
    for (std::size_t c = 0; c < corners.size(); ++c) {
      if (back[c] != 0) corners[c] = before_[static_cast<std::size_t>(corners_.nodes()[c])];
    }
  }
}

template <class Real>
bool MidNodes<Real>::stays_valid(Positions after) const {
  std::atomic<bool> valid = true;
  visit_spoilt(after, [&](std::span<const NodeId>) { valid.store(false); });
  return valid;
}

template class MidNodes<float>;
template class MidNodes<double>;

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <array>

#include "mesh/tetrahedron_batch.hpp"
#include "smooth/guard/acceptance.hpp"

namespace meshsmooth::detail {

/// The ball of a node in a mesh of tetrahedra, held on the stack: read once for all trials of a
/// move, and evaluated in batches.
class HeldBall {
 public:
  [[nodiscard]] static bool fits(const Surroundings& around, std::size_t node) {
    const std::size_t size = around.balls.size(node);
    return around.elements.tetrahedra && size > 0 && size <= kCapacity;
  }

  template <class P>
  HeldBall(const Surroundings& around, const P& x, std::size_t node, Acceptance acceptance)
      : acceptance_(acceptance) {
    const ElementId* const ball = around.balls.begin(node);
    const auto size = static_cast<int>(around.balls.size(node));
    batch_count_ = (size + kSize - 1) / kSize;
    for (int t = 0; t < batch_count_ * kSize; ++t) {
      // The last batch is filled up by an element that is there anyway.
      const ElementView element = around.elements.get<true>(ball[t < size ? t : 0]);
      batches_[t / kSize].set(t % kSize, x, element.nodes);
      // No branches: a mispredicted one would wait for the nodes to come from memory.
      const auto own = static_cast<NodeId>(node);
      own_[t / kSize][t % kSize] = (element.nodes[1] == own ? 1 : 0) +
                                   (element.nodes[2] == own ? 2 : 0) +
                                   (element.nodes[3] == own ? 3 : 0);
    }
    for (int b = 0; b < batch_count_; ++b) {
      before_[b] = qualities(b);
      const double lowest = *std::min_element(before_[b].begin(), before_[b].end());
      if (lowest < worst_) {
        worst_ = lowest;
        suspect_ = b;
      }
    }
  }

  /// Whether no element of the ball forbids the node to move there.
  template <class Real>
  [[nodiscard]] bool allows(Vec3<Real> position) {
    // What forbade one trial is likely to forbid the next; at first the worst element.
    for (int n = 0; n < batch_count_; ++n) {
      const int b = (suspect_ + n) % batch_count_;
      if (allowed(qualities_at(b, vec3_cast<double>(position)), before_[b])) continue;
      suspect_ = b;
      return false;
    }
    return true;
  }

 private:
  static constexpr int kSize = TetrahedronBatch::kSize;
  static constexpr int kMostBatches = 8;
  static constexpr int kCapacity = kMostBatches * kSize;
  using Qualities = std::array<double, kSize>;

  [[nodiscard]] Qualities qualities(int batch) const {
    return batches_[batch].evaluate<1>([](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      return std::array{tetrahedron_quality(p0, p1, p2, p3)};
    })[0];
  }
  /// Where the node is at a position.
  [[nodiscard]] Qualities qualities_at(int batch, Vec3d position) const {
    const std::int64_t* const own = own_[batch];
    return batches_[batch].evaluate_lanes<1>([=](int t, Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      const auto at = [&](int n, Vec3d p) {
        const bool moved = own[t] == n;
        return Vec3d{moved ? position.x : p.x, moved ? position.y : p.y, moved ? position.z : p.z};
      };
      return std::array{tetrahedron_quality(at(0, p0), at(1, p1), at(2, p2), at(3, p3))};
    })[0];
  }
  [[nodiscard]] bool allowed(const Qualities& qualities, const Qualities& before) const {
    bool all = true;
    for (int t = 0; t < kSize; ++t) {
      all &= is_allowed(acceptance_, qualities[t], worst_, [&] { return before[t]; });
    }
    return all;
  }

  Acceptance acceptance_;
  int batch_count_;
  int suspect_ = 0;
  double worst_ = 2.0;
  TetrahedronBatch batches_[kMostBatches];
  Qualities before_[kMostBatches];
  std::int64_t own_[kMostBatches][kSize];  // the local number of the node, as wide as a coordinate
};

/// The thread of a CPU that moves a node.
struct CpuThread : SingleThread {};

/// `accept_move`, on a held ball.
/// cost  a third of that on the elements as they lie (smart Laplacian at 100k nodes)
template <bool kTetrahedra = false, class P>
Vec3<typename P::Real> accept_move(const CpuThread& thread, const Surroundings& around, const P& x,
                                   std::size_t node, Vec3<typename P::Real> candidate,
                                   const MoveRule<typename P::Real>& rule, bool& held) {
  const Acceptance acceptance = rule.acceptance;
  const SingleThread& single = thread;
  const Vec3<typename P::Real> before = x[node];
  if (!HeldBall::fits(around, node) || candidate == before) {
    return accept_move(single, around, x, node, candidate, rule, held);
  }
  return run_wide([&] {
    HeldBall ball(around, x, node, acceptance);
    return first_allowed(
        around, node, before, candidate, rule, held, [&](Vec3<typename P::Real> position) {
          return !(acceptance.facets && !keeps_facets(single, around.sliding, x, node, position)) &&
                 ball.allows(position);
        });
  });
}

}  // namespace meshsmooth::detail

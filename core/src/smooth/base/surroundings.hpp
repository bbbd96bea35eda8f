#pragma once

#include "meshsmooth/quality.hpp"
#include "smooth/base/anchor.hpp"
#include "smooth/base/sliding_constraints.hpp"
#include "smooth/base/targets.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// Everything that the rules read besides positions, in executor memory.
struct Surroundings {
  std::size_t node_count;
  Elements elements;
  Rows<NodeId> rings;
  Rows<ElementId> balls;              // only where a method or the guard needs them
  const std::uint8_t* fixed;          // one byte a node
  const PackedDirection* references;  // a normal per surface element; null: all have `reference`
  Vec3d reference;
  // Of a mesh of tetrahedra, for Optimize: for each entry of the balls the three other nodes, in
  // the order of the corner's edges. Without it, loads depend on each other: ball, element, local
  // node, neighbours' order, positions.
  const NodeId* opposite = nullptr;
  SlidingConstraints sliding{};
  Targets targets{};                // of Optimize
  const Anchor* anchors = nullptr;  // the same, by node; null: none

  [[nodiscard]] MESHSMOOTH_HD Vec3d reference_of(std::size_t element) const {
    return references == nullptr ? reference : unpack_direction(references[element]);
  }
  [[nodiscard]] MESHSMOOTH_HD bool surface() const {
    return references != nullptr || dot(reference, reference) > 0;
  }
};

/// Reads positions that are not written concurrently, except for nodes of another colour.
template <class R>
struct QuietPositions {
  using Real = R;
  const Vec3<R>* data;
  [[nodiscard]] MESHSMOOTH_HD Vec3<R> operator[](std::size_t node) const { return data[node]; }
};

/// Threads that evaluate one node's ball together: each takes every `size`-th element from `rank`
/// on, and all get the combined result. A backend may have larger teams.
struct SingleThread {
  static constexpr int size = 1;
  static constexpr int rank = 0;
  [[nodiscard]] MESHSMOOTH_HD double lowest(double value) const { return value; }
  template <class T>
  [[nodiscard]] MESHSMOOTH_HD T sum(T value) const {
    return value;
  }
  [[nodiscard]] MESHSMOOTH_HD bool all(bool value) const { return value; }
};

/// Prefetches the data of upcoming node visits. Nodes of a colour lie far apart in memory, where
/// processors do not prefetch by themselves. On a GPU, whose other threads work meanwhile, it does
/// nothing.
template <class Real>
struct Lookahead {
  static constexpr std::size_t kRows = 4, kContents = 2;  // visits ahead

  Surroundings around;
  const Vec3<Real>* positions;
  bool balls;  // whether visits read them

  /// Before the visit of `nodes[n]`, of `count`.
  [[gnu::always_inline]] MESHSMOOTH_HD inline void operator()(
      [[maybe_unused]] const NodeId* nodes, [[maybe_unused]] std::size_t n,
      [[maybe_unused]] std::size_t count) const {
#ifndef __CUDA_ARCH__
    if (n + kRows < count) fetch_rows(static_cast<std::size_t>(nodes[n + kRows]));
    if (n + kContents < count) fetch_contents(static_cast<std::size_t>(nodes[n + kContents]));
#endif
  }

 private:
  static constexpr std::size_t kLine = 64;  // bytes that come at once

  template <class T>
  [[gnu::always_inline]] static inline void fetch(const T* begin, const T* end) {
    for (const T* p = begin; p < end; p += kLine / sizeof(T)) __builtin_prefetch(p);
  }
  [[gnu::always_inline]] inline void fetch_rows(std::size_t node) const {
    fetch(around.rings.begin(node), around.rings.end(node));
    if (!balls) return;
    if (around.opposite == nullptr) {
      fetch(around.balls.begin(node), around.balls.end(node));
    } else {
      fetch(around.opposite + 3 * around.balls.offsets[node],
            around.opposite + 3 * around.balls.offsets[node + 1]);
    }
  }
  [[gnu::always_inline]] inline void fetch_contents(std::size_t node) const {
    const NodeId* const last = around.rings.end(node);
    for (const NodeId* n = around.rings.begin(node); n < last; ++n) {
      __builtin_prefetch(positions + *n);
    }
    if (!balls || around.opposite != nullptr) return;
    const ElementId* const end = around.balls.end(node);
    for (const ElementId* e = around.balls.begin(node); e < end; ++e) {
      __builtin_prefetch(around.elements[*e].nodes);
    }
  }
};

}  // namespace meshsmooth::detail

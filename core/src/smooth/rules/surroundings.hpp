#pragma once

#include "meshsmooth/quality.hpp"
#include "smooth/rules/anchor.hpp"
#include "smooth/rules/sliding_constraints.hpp"
#include "smooth/rules/targets.hpp"
#include "smooth/rules/topology.hpp"

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
  [[nodiscard]] bool surface() const {
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

}  // namespace meshsmooth::detail

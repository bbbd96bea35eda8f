#pragma once

#include "smooth/cuda/base/launch.cuh"
#include "smooth/cuda/primitives/vector_access.cuh"
#include "smooth/guard/acceptance.hpp"
#include "smooth/guard/partial_moves.hpp"

namespace meshsmooth::detail {

/// How often the moves of a step are cut: a word per node with a bit for each round in which a
/// broken element demanded it, and above them the number of earlier cuts. Readers mask the bits
/// that other threads set in the same round, so a round needs one barrier only.
class MoveCuts {
 public:
  static constexpr int kRounds = 28;

  /// `words`: of each node, 0 before.
  __device__ explicit MoveCuts(unsigned int* words) : words_(words) {}

  /// The cuts demanded of a node before a round.
  [[nodiscard]] __device__ unsigned int word_before(int round, std::size_t node) const {
    return static_cast<volatile unsigned int&>(words_[node]) & ~(kAll & (kAll << round));
  }
  [[nodiscard]] static __device__ int count(unsigned int word) {
    return static_cast<int>(word >> kRounds) + __popc(word & kAll);
  }
  /// Whether the previous round demanded a cut; not for round 0.
  [[nodiscard]] static __device__ bool changed(int round, unsigned int word) {
    return (word >> (round - 1) & 1U) != 0;
  }
  __device__ void demand(int round, std::size_t node) const {
    atomicOr(&words_[node], 1U << round);
  }
  /// After `kRounds` rounds, between two barriers: frees bits, so that round 1 can follow.
  __device__ void fold(std::size_t node) const {
    const unsigned int word = static_cast<volatile unsigned int&>(words_[node]);
    const int all = count(word), last = changed(kRounds, word) ? 1 : 0;
    const int earlier = (all < kMoveTrials ? all : kMoveTrials) - last;
    words_[node] = static_cast<unsigned int>(earlier) << kRounds | static_cast<unsigned int>(last);
  }
  /// The number of cuts after the last round; resets it.
  [[nodiscard]] __device__ int take(std::size_t node) const {
    const int cuts = count(static_cast<volatile unsigned int&>(words_[node]));
    if (cuts > 0) words_[node] = 0;
    return cuts;
  }

 private:
  static constexpr unsigned int kAll = (1U << kRounds) - 1;
  unsigned int* words_;
};

/// A step whose moves are cut, in device memory.
template <class Real>
struct CutStep {
  const Vec3<Real>*before, *after;
  MoveCuts cuts;
};

/// Rounds that visit all elements, of a mesh of any types.
template <class Real>
class AllElements {
 public:
  struct Room {};

  __device__ AllElements(const Surroundings& around, ElementId*, Room&) : around_(around) {}

  __device__ void find(const CutStep<Real>&, const BoundingSphere*) {}

  /// Demands cuts for the broken elements. Returns whether there are any.
  __device__ bool visit(const CutStep<Real>& step, int round) const {
    bool broken = false;
    for_each_in_grid(around_.elements.count,
                     [&](std::size_t e) { broken |= visit_element(step, round, e); });
    return broken;
  }

 private:
  __device__ bool visit_element(const CutStep<Real>& step, int round, std::size_t e) const {
    const ElementView element = around_.elements[e];
    const auto node = [&](int n) { return static_cast<std::size_t>(element.nodes[n]); };
    int cuts[kMaxElementNodes] = {};
    bool changed = round == 0;
    for (int n = 0; round > 0 && n < element.shape->node_count; ++n) {
      const unsigned int word = step.cuts.word_before(round, node(n));
      cuts[n] = MoveCuts::count(word);
      changed |= MoveCuts::changed(round, word);
    }
    if (!changed) return false;
    const auto position = [&](int n) {
      return vec3_cast<double>(cut_move(step.before[node(n)], step.after[node(n)], cuts[n]));
    };
    const Vec3d reference = around_.reference_of(e);
    if (element_quality(*element.shape, position, reference) > 0 ||
        !is_positive<false>(around_, QuietPositions<Real>{step.before}, e)) {
      return false;
    }
    for (int n = 0; n < element.shape->node_count; ++n) step.cuts.demand(round, node(n));
    return true;
  }

  Surroundings around_;
};

/// Rounds that visit only the tetrahedra that a step might break; all others stay positive however
/// the moves are cut. A first test by bounding spheres reads a third of the moves' bytes; a tighter
/// one clears most of those that fail it.
template <class Real>
class Suspects {
 public:
  static constexpr int kRoom = 40 * 1024 / (24 * sizeof(Real) + 4 * sizeof(NodeId));

  /// Copies of the first suspects, for shared memory.
  struct Room {
    NodeId nodes[4][kRoom];
    Real before[4][3][kRoom], after[4][3][kRoom];
    unsigned int candidates, count;
  };

  /// `list`: for all elements of the block, in device memory.
  __device__ Suspects(const Surroundings& around, ElementId* list, Room& room)
      : elements_(around.elements), list_(list), room_(room) {}

  __device__ void find(const CutStep<Real>& step, const BoundingSphere* spheres) {
    if (threadIdx.x == 0) room_.candidates = room_.count = 0;
    __syncthreads();
    list_uncertain(spheres);
    __syncthreads();
    for (unsigned int begin = 0; begin < room_.candidates; begin += kBlockSize) {
      const unsigned int n = begin + threadIdx.x;
      const ElementId e = n < room_.candidates ? list_[n] : 0;
      __syncthreads();  // `keep` overwrites entries that have been read
      if (n < room_.candidates) keep(step, e);
    }
    __syncthreads();
  }

  __device__ bool visit(const CutStep<Real>& step, int round) const {
    bool broken = false;
    for (unsigned int n = threadIdx.x; n < room_.count; n += kBlockSize) {
      if (n < kRoom) {
        broken |= visit_tetrahedron(
            step, round, [&](int k) { return room_.nodes[k][n]; },
            [&](int k) { return load(room_.before[k], n); },
            [&](int k) { return load(room_.after[k], n); });
      } else {
        const NodeId* const nodes = elements_.template get<true>(list_[n - kRoom]).nodes;
        broken |= visit_tetrahedron(
            step, round, [&](int k) { return nodes[k]; },
            [&](int k) { return step.before[nodes[k]]; },
            [&](int k) { return step.after[nodes[k]]; });
      }
    }
    return broken;
  }

 private:
  __device__ void list_uncertain(const BoundingSphere* spheres) {
    for_each_in_grid(elements_.count, [&](std::size_t e) {
      NodeId nodes[4];
      load_group<4>(elements_.template get<true>(e).nodes, nodes);
      Vec3f centres[4];
      float radii[4];
#pragma unroll
      for (int n = 0; n < 4; ++n) {
        float sphere[4];
        load_group<4>(&spheres[nodes[n]].centre.x, sphere);
        centres[n] = {sphere[0], sphere[1], sphere[2]};
        radii[n] = sphere[3];
      }
      if (is_positive_within(centres, radii)) return;
      list_[atomicAdd(&room_.candidates, 1U)] = static_cast<ElementId>(e);
    });
  }

  /// Copies a candidate unless the tighter test clears it or it was inverted before.
  __device__ void keep(const CutStep<Real>& step, ElementId e) {
    NodeId nodes[4];
    load_group<4>(elements_.template get<true>(e).nodes, nodes);
    Vec3<Real> before[4], after[4];
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      before[k] = step.before[nodes[k]];
      after[k] = step.after[nodes[k]];
    }
    if (is_positive_on_the_way<Real>([&](int k) { return before[k]; },
                                     [&](int k) { return after[k]; }) ||
        !are_positive([&](int k) { return before[k]; })) {
      return;
    }
    const unsigned int n = atomicAdd(&room_.count, 1U);
    if (n >= kRoom) {
      list_[n - kRoom] = e;
      return;
    }
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      room_.nodes[k][n] = nodes[k];
      store(room_.before[k], n, before[k]);
      store(room_.after[k], n, after[k]);
    }
  }

  template <class Node, class Before, class After>
  static __device__ bool visit_tetrahedron(const CutStep<Real>& step, int round, const Node& node,
                                           const Before& before, const After& after) {
    unsigned int words[4] = {};
#pragma unroll
    for (int k = 0; round > 0 && k < 4; ++k) {
      words[k] = step.cuts.word_before(round, static_cast<std::size_t>(node(k)));
    }
    const unsigned int any = words[0] | words[1] | words[2] | words[3];
    if (round > 0 && !MoveCuts::changed(round, any)) return false;
    if (are_positive(
            [&](int k) { return cut_move(before(k), after(k), MoveCuts::count(words[k])); })) {
      return false;
    }
    for (int k = 0; k < 4; ++k) step.cuts.demand(round, static_cast<std::size_t>(node(k)));
    return true;
  }
  template <class At>
  static __device__ bool are_positive(const At& at) {
    return tetrahedron_is_positive(vec3_cast<double>(at(0)), vec3_cast<double>(at(1)),
                                   vec3_cast<double>(at(2)), vec3_cast<double>(at(3)));
  }
  static __device__ Vec3<Real> load(const Real (&from)[3][kRoom], unsigned int n) {
    return {from[0][n], from[1][n], from[2][n]};
  }
  static __device__ void store(Real (&to)[3][kRoom], unsigned int n, Vec3<Real> position) {
    to[0][n] = position.x;
    to[1][n] = position.y;
    to[2][n] = position.z;
  }

  Elements elements_;
  ElementId* list_;
  Room& room_;
};

}  // namespace meshsmooth::detail

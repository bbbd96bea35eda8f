#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "mesh/tetrahedron_batch.hpp"
#include "mesh/wide.hpp"
#include "smooth/base/topology.hpp"
#include "smooth/cpu/cpu_buffer.hpp"
#include "smooth/guard/partial_moves.hpp"
#include "smooth/guard/positive_tetrahedra.hpp"

namespace meshsmooth::detail {

/// The tetrahedra of a mesh that moves of its nodes, or parts of them along straight ways, might
/// break; all others keep their sign. A move's bounding sphere, in float, has a third of its bytes:
/// gathering them is most of a test.
class CpuSuspects {
 public:
  static constexpr bool kPossible = true;

  /// Of those that are positive at `before`.
  /// cost   a test in float per element; `suspects_bytes`, which it keeps
  template <class E, class Real>
  void find(E& executor, const Elements& elements, std::size_t node_count, const Vec3<Real>* before,
            const Vec3<Real>* after) {
    if (list_.size() == 0) {
      spheres_ = executor.template allocate<BoundingSphere>(node_count);
      list_ = executor.template allocate<ElementId>(elements.count);
    }
    // Floats tell nodes apart near the origin only.
    const Vec3d origin = vec3_cast<double>(before[0]);
    executor.for_each(node_count, [&](std::size_t node) {
      spheres_.data()[node] = bounding_sphere_of_move(before[node], after[node], origin);
    });
    // Each range lists its own where it begins.
    std::vector<std::size_t> listed((elements.count + kRange - 1) / kRange);
    executor.for_each_range(
        elements.count,
        [&](std::size_t begin, std::size_t end) {
          ElementId* const own = list_.data() + begin;
          listed[begin / kRange] =
              keep_positive(elements, before, own, list_uncertain(elements, begin, end, own));
        },
        kRange);
    // In their order, so that a thread mostly visits elements whose nodes it moved itself.
    count_ = 0;
    for (std::size_t range = 0; range < listed.size(); ++range) {
      const ElementId* const own = list_.data() + range * kRange;
      std::copy(own, own + listed[range], list_.data() + count_);
      count_ += listed[range];
    }
  }

  [[nodiscard]] const ElementId* data() const { return list_.data(); }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  static constexpr std::size_t kRange = 2048;
  static constexpr std::size_t kSize = TetrahedronBatch::kSize;
  struct SphereBatch {
    float of[4][4][kSize];  // by corner: x, y, z of the centre, radius
  };

  /// Lists those of [begin, end) that might break. Returns how many.
  std::size_t list_uncertain(const Elements& elements, std::size_t begin, std::size_t end,
                             ElementId* list) const {
    return run_wide([&] {
      std::size_t count = 0;
      for (std::size_t first = begin; first < end; first += kSize) {
        SphereBatch batch;
        gather(elements, first, end, batch);
        std::array<std::int32_t, kSize> uncertain;
        for (std::size_t t = 0; t < kSize; ++t) {
          const auto& of = batch.of;
          const auto at = [&](int n) { return Vec3f{of[n][0][t], of[n][1][t], of[n][2][t]}; };
          uncertain[t] = is_positive_within({at(0), at(1), at(2), at(3)},
                                            {of[0][3][t], of[1][3][t], of[2][3][t], of[3][3][t]})
                             ? 0
                             : 1;
        }
        const std::size_t size = std::min(kSize, end - first);
        for (std::size_t t = 0; t < size; ++t) {
          list[count] = static_cast<ElementId>(first + t);
          count += static_cast<std::size_t>(uncertain[t]);
        }
      }
      return count;
    });
  }

  /// The spheres of the batch that begins with the tetrahedron `first`, filled up by the last.
  [[gnu::always_inline]] inline void gather(const Elements& elements, std::size_t first,
                                            std::size_t end, SphereBatch& batch) const {
    std::array<const NodeId*, kSize> nodes;
    for (std::size_t t = 0; t < kSize; ++t) {
      nodes[t] = elements.get<true>(std::min(first + t, end - 1)).nodes;
    }
    for (int corner = 0; corner < 4; ++corner) {
      transpose_eight([&](std::size_t t) { return spheres_.data() + nodes[t][corner]; },
                      batch.of[corner]);
    }
  }

  /// Keeps those of a list that are positive. Returns how many.
  template <class Real>
  static std::size_t keep_positive(const Elements& elements, const Vec3<Real>* positions,
                                   ElementId* list, std::size_t size) {
    std::size_t count = 0;
    for (std::size_t first = 0; first < size; first += kVisitBatch) {
      const std::size_t few = std::min(kVisitBatch, size - first);
      const unsigned int positive = positive_tetrahedra(
          elements, [&](std::size_t n) { return std::size_t{list[first + n]}; }, few, positions);
      for (std::size_t n = 0; n < few; ++n) {
        list[count] = list[first + n];
        count += positive >> n & 1U;
      }
    }
    return count;
  }

  CpuBuffer<BoundingSphere> spheres_;
  CpuBuffer<ElementId> list_;
  std::size_t count_ = 0;
};

}  // namespace meshsmooth::detail

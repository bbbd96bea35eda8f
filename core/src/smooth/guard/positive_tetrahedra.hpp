#pragma once

#include "mesh/tetrahedron_batch.hpp"
#include "smooth/base/element_quality.hpp"
#include "smooth/base/executor.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// Those of the tetrahedra `id(0)`, … `id(count - 1)`, as bits, that are positive at `positions`.
template <class Real, class Id>
[[nodiscard]] unsigned int positive_tetrahedra(const Elements& elements, const Id& id,
                                               std::size_t count, const Vec3<Real>* positions) {
  static_assert(kVisitBatch == TetrahedronBatch::kSize);
  return run_wide([&] {
    TetrahedronBatch batch;
    batch.set_all(positions,
                  [&](std::size_t t) { return elements.get<true>(id(t < count ? t : 0)).nodes; });
    const auto positive = batch.evaluate<1>([](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      return std::array{tetrahedron_is_positive(p0, p1, p2, p3) ? 1.0 : 0.0};
    })[0];
    unsigned int bits = 0;
    for (unsigned int t = 0; t < kVisitBatch; ++t) bits |= positive[t] != 0 ? 1U << t : 0U;
    return bits;
  });
}

}  // namespace meshsmooth::detail

#pragma once

#include <array>

#include "mesh/measure.hpp"
#include "mesh/tetrahedron_batch.hpp"

namespace meshsmooth::detail {

/// `measure_tetrahedron` of a batch.
[[nodiscard]] inline std::array<ElementMeasure, TetrahedronBatch::kSize> measure_tetrahedra(
    const TetrahedronBatch& batch) {
  const auto results = run_wide([&] {
    return batch.evaluate<8>([](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      const ElementMeasure m = measure_tetrahedron(p0, p1, p2, p3);
      return std::array{m.mean_ratio,         m.scaled_jacobian,     m.radius_ratio,
                        m.min_angle_cos,      m.max_angle_cos,       m.volume,
                        m.inverted ? 1.0 : 0, m.degenerate ? 1.0 : 0};
    });
  });
  std::array<ElementMeasure, TetrahedronBatch::kSize> measures;
  for (std::size_t t = 0; t < measures.size(); ++t) {
    ElementMeasure& m = measures[t];
    m.mean_ratio = results[0][t];
    m.scaled_jacobian = results[1][t];
    m.radius_ratio = results[2][t];
    m.min_angle_cos = results[3][t];
    m.max_angle_cos = results[4][t];
    m.volume = results[5][t];
    m.inverted = results[6][t] != 0;
    m.degenerate = results[7][t] != 0;
  }
  return measures;
}

/// The brief evaluation of a batch, without roots and divisions except that of the volume.
class ClearTetrahedra {
 public:
  static constexpr int kSize = TetrahedronBatch::kSize;

  explicit ClearTetrahedra(const TetrahedronBatch::Results<2>& results) : results_(results) {}
  /// Neither inverted nor degenerate, and its mean ratio certainly above the least.
  [[nodiscard]] bool clear(int t) const { return results_[0][t] != 0; }
  /// With the bits of `measure_tetrahedron`.
  [[nodiscard]] double volume(int t) const { return results_[1][t]; }

 private:
  TetrahedronBatch::Results<2> results_;
};

/// Formula of `find_clear`.
inline std::array<double, 2> clear_and_volume(Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3,
                                              double least_cube) {
  const Vec3d a = p1 - p0, b = p2 - p0, c = p3 - p0;
  const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
  const Vec3d ab = b - a, ac = c - a, bc = c - b;
  const double determinant = dot(a, cross(b, c));
  const double edges = aa + bb + cc + dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
  // Twice the bound: on this side of it rounding makes no difference.
  const bool positive = determinant > 0;
  const bool certain = determinant * determinant > 4 * kSignBound * kSignBound * (aa * bb * cc);
  const bool good = 432 * determinant * determinant > least_cube * (edges * edges * edges);
  return {positive & certain & good ? 1.0 : 0.0, determinant / 6};
}

/// `least_cube` is of a mean ratio.
[[nodiscard]] inline ClearTetrahedra find_clear(const TetrahedronBatch& batch, double least_cube) {
  return ClearTetrahedra(run_wide([&] {
    return batch.evaluate<2>([=](Vec3d p0, Vec3d p1, Vec3d p2, Vec3d p3) {
      return clear_and_volume(p0, p1, p2, p3, least_cube);
    });
  }));
}

}  // namespace meshsmooth::detail

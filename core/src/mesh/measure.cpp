// The measures of one element.

#include "mesh/tetrahedron.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {
namespace {

double mean_ratio(const ElementShape& shape, const CornerGeometry& corner) {
  if (!(corner.shape_norm_squared > 0)) return 0;
  const double determinant = corner.determinant / shape.ideal.determinant;
  if (shape.dimension == 2) return 2 * determinant / corner.shape_norm_squared;
  const double ratio = 3 * std::cbrt(determinant * determinant) / corner.shape_norm_squared;
  return determinant < 0 ? -ratio : ratio;
}

double scaled_jacobian(const ElementShape& shape, const CornerGeometry& corner) {
  if (!(corner.length_product > 0)) return 0;
  return corner.determinant / (corner.length_product * shape.ideal.determinant);
}

/// Area of a surface element: that of its projection along its mean normal.
double signed_area(const ElementShape& shape, const Vec3d* p, Vec3d reference) {
  const Vec3d normal =
      shape.node_count == 3 ? cross(p[1] - p[0], p[2] - p[0]) : cross(p[2] - p[0], p[3] - p[1]);
  const double area = norm(normal) / 2;
  return dot(normal, reference) < 0 ? -area : area;
}

/// Sum of the cones from node 0 over the facets. A facet of four nodes is the
/// bilinear patch, whose cone is the mean of its two triangulations.
double signed_volume(const ElementShape& shape, const Vec3d* p) {
  double sixfold = 0;
  for (int f = 0; f < shape.facet_count; ++f) {
    const FacetShape& facet = shape.facets[f];
    const auto at = [&](int n) { return p[facet.nodes[n]] - p[0]; };
    const auto cone = [&](int i, int j, int k) { return dot(at(i), cross(at(j), at(k))); };
    sixfold += facet.node_count == 3
                   ? cone(0, 1, 2)
                   : (cone(0, 1, 2) + cone(0, 2, 3) + cone(0, 1, 3) + cone(1, 2, 3)) / 2;
  }
  return sixfold / 6;
}

void measure_triangle_angles(const Vec3d* p, ElementMeasure& measure) {
  measure.min_angle_cos = -1;
  measure.max_angle_cos = 1;
  for (int n = 0; n < 3; ++n) {
    const Vec3d a = p[(n + 1) % 3] - p[n], b = p[(n + 2) % 3] - p[n];
    const double lengths = std::sqrt(dot(a, a) * dot(b, b));
    const double cosine = dot(a, b) / lengths;
    if (!(lengths > 0) || measure.inverted) {
      measure.min_angle_cos = 1;
      measure.max_angle_cos = -1;
      return;
    }
    if (cosine > measure.min_angle_cos) measure.min_angle_cos = cosine < 1 ? cosine : 1;
    if (cosine < measure.max_angle_cos) measure.max_angle_cos = cosine > -1 ? cosine : -1;
  }
}

ElementMeasure measure_by_corners(ElementType type, const Vec3d* p, Vec3d reference) {
  const ElementShape& shape = element_shape(type);
  ElementMeasure measure;
  bool certain = true;
  for (int k = 0; k < shape.corner_count; ++k) {
    const CornerGeometry corner = corner_geometry(
        shape, k, [p](int n) { return p[n]; }, reference);
    const double ratio = mean_ratio(shape, corner);
    const double jacobian = scaled_jacobian(shape, corner);
    if (k == 0 || ratio < measure.mean_ratio) measure.mean_ratio = ratio;
    if (k == 0 || jacobian < measure.scaled_jacobian) measure.scaled_jacobian = jacobian;
    measure.inverted |= corner.sign < 0;
    certain &= corner.sign > 0;
  }
  measure.degenerate = !certain && !measure.inverted;
  measure.volume =
      shape.dimension == 2 ? signed_area(shape, p, reference) : signed_volume(shape, p);
  if (type == ElementType::triangle) measure_triangle_angles(p, measure);
  return measure;
}

}  // namespace

ElementMeasure measure_element(ElementType type, const Vec3d* corners, Vec3d reference) {
  if (type != ElementType::tetrahedron) return measure_by_corners(type, corners, reference);
  const detail::TetrahedronMeasure tetrahedron =
      detail::measure_tetrahedron(corners[0], corners[1], corners[2], corners[3]);
  return {.mean_ratio = detail::mean_ratio(tetrahedron.determinant, tetrahedron.edge_sum),
          .scaled_jacobian = tetrahedron.scaled_jacobian,
          .volume = tetrahedron.determinant / 6,
          .inverted = tetrahedron.sign < 0,
          .degenerate = tetrahedron.sign == 0,
          .radius_ratio = tetrahedron.radius_ratio,
          .min_angle_cos = tetrahedron.min_angle_cos,
          .max_angle_cos = tetrahedron.max_angle_cos};
}

}  // namespace meshsmooth

#pragma once

#include <cmath>

#include "meshsmooth/vec3.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

/// The edge lengths of an element with right angles. Quadrilateral, hexahedron: along its two or
/// three directions. Pyramid: along its base, and the edge of an ideal one of its height. Wedge:
/// its height, then the edges 0-1, 1-2 and 2-0 of its triangle.
struct alignas(16) BoxLengths {
  float of[4];
};

/// The shape that each element's corners aim at, in executor memory: its own one in a reference
/// mesh, a box of given lengths, or by default the ideal shape of its type.
///
/// With W the matrix of a corner's edges in the target and E that in the mesh, T = E W^-1 takes the
/// place of the shape matrix. Moving one node adds a matrix of rank one to E, so D = det T stays
/// linear and S = |T|^2 a parabola in the displacement for every W: the energy of a ball stays
/// convex where its elements are valid.
struct Targets {
  const Vec3d* reference = nullptr;   // by node
  bool some_flat = false;             // of the reference: their shape is the ideal one
  const BoxLengths* boxes = nullptr;  // by element, without the simplices that come first
  std::size_t first_box = 0;          // the element that boxes[0] belongs to
  /// Rounding in D exceeds that against an ideal corner by the skewness of the target's corners,
  /// the product of their edges over their determinant: by the largest to the power of -2/d
  /// `stretch` must stay further below `kCertainStretch`.
  double certainty = 1;

  [[nodiscard]] MESHSMOOTH_HD bool any() const { return reference != nullptr || boxes != nullptr; }
};

/// A reference corner is flat below this share of the product of its edges.
inline constexpr double kFlatShare = 1e-8;
/// The most skewness of a box's corners; more is replaced by the ideal shape.
inline constexpr double kBoxSkewness = 100;

/// A corner of a target by its edges; those of a surface are laid into a plane.
template <int kDimension>
MESHSMOOTH_HD IdealCorner corner_of_edges(const Vec3d (&w)[kDimension]) {
  IdealCorner corner{};
  if constexpr (kDimension == 3) {
    const Vec3d rows[] = {cross(w[1], w[2]), cross(w[2], w[0]), cross(w[0], w[1])};
    corner.determinant = dot(w[0], rows[0]);
    const double inverse = 1 / corner.determinant;
    for (int m = 0; m < 3; ++m) {
      corner.inverse[m][0] = inverse * rows[m].x;
      corner.inverse[m][1] = inverse * rows[m].y;
      corner.inverse[m][2] = inverse * rows[m].z;
    }
  } else {
    const double length = norm(w[0]);
    corner.determinant = norm(cross(w[0], w[1]));
    corner.inverse[0][0] = 1 / length;
    corner.inverse[0][1] = -dot(w[0], w[1]) / (length * corner.determinant);
    corner.inverse[1][1] = length / corner.determinant;
  }
  return corner;
}

/// The ideal corner with edges of this length.
MESHSMOOTH_HD inline IdealCorner scaled_ideal(const ElementShape& shape, double length) {
  IdealCorner corner = shape.ideal;
  for (int m = 0; m < shape.dimension; ++m) {
    for (int c = 0; c < shape.dimension; ++c) corner.inverse[m][c] /= length;
    corner.determinant *= length;
  }
  return corner;
}

/// The determinant of a corner's edges as a share of the product of their lengths; 0 if one has no
/// length. `get(n)` gives the position of local node n.
template <int kDimension, class Get>
MESHSMOOTH_HD double corner_share(const CornerShape& corner, const Get& get) {
  const Vec3d origin = get(corner.node);
  const Vec3d a = get(corner.neighbours[0]) - origin;
  const Vec3d b = get(corner.neighbours[1]) - origin;
  double determinant = 0;
  double squares = dot(a, a) * dot(b, b);
  if constexpr (kDimension == 3) {
    const Vec3d c = get(corner.neighbours[2]) - origin;
    determinant = dot(a, cross(b, c));
    squares *= dot(c, c);
  } else {
    determinant = norm(cross(a, b));
  }
  return squares > 0 ? determinant / std::sqrt(squares) : 0;
}

/// The least `corner_share` of an element.
template <int kDimension, class Get>
MESHSMOOTH_HD double least_corner_share(const ElementShape& shape, const Get& get) {
  double least = 1;
  for (int k = 0; k < shape.corner_count; ++k) {
    const double share = corner_share<kDimension>(shape.corners[k], get);
    if (!(share >= least)) least = share;
  }
  return least;
}

/// The root of the mean squared edge length of an element.
template <class Get>
MESHSMOOTH_HD double rms_edge(const ElementShape& shape, const Get& get) {
  double sum = 0;
  for (int n = 0; n < shape.edge_count; ++n) {
    const Vec3d edge = get(shape.edges[n][1]) - get(shape.edges[n][0]);
    sum += dot(edge, edge);
  }
  return std::sqrt(sum / shape.edge_count);
}

/// The direction of an edge in a box: 0 and 1 along the base, 2 upright.
MESHSMOOTH_HD inline int box_direction(int a, int b) {
  if (a / 4 != b / 4) return 2;
  return a % 4 + b % 4 == 3 ? 1 : 0;
}

/// Positions of a wedge's or pyramid's nodes.
MESHSMOOTH_HD inline Vec3d box_node(const ElementShape& shape, const BoxLengths& box, int n) {
  const double a = box.of[0], b = box.of[1], c = box.of[2];
  if (shape.node_count == 5) {
    constexpr double kIdealHeight = 0.70710678118654752440;
    if (n == 4) return {a / 2, b / 2, kIdealHeight * c};
    return {n == 1 || n == 2 ? a : 0, n >= 2 ? b : 0, 0};
  }
  const double z = n < 3 ? 0 : -a;
  if (n % 3 == 0) return {0, 0, z};
  if (n % 3 == 1) return {b, 0, z};
  const double d = box.of[3];
  const double x = (b * b + d * d - c * c) / (2 * b);
  return {x, std::sqrt(d * d - x * x), z};
}

/// Corner `k` of a box.
template <int kDimension>
MESHSMOOTH_HD IdealCorner box_corner(const ElementShape& shape, const BoxLengths& box, int k) {
  const CornerShape& corner = shape.corners[k];
  if (kDimension == 2 || shape.node_count == 8) {
    IdealCorner result{};
    result.determinant = 1;
    for (int m = 0; m < kDimension; ++m) {
      const double length = box.of[box_direction(corner.node, corner.neighbours[m])];
      result.inverse[m][m] = 1 / length;
      result.determinant *= length;
    }
    return result;
  }
  const Vec3d origin = box_node(shape, box, corner.node);
  Vec3d edges[kDimension];
  for (int m = 0; m < kDimension; ++m)
    edges[m] = box_node(shape, box, corner.neighbours[m]) - origin;
  return corner_of_edges<kDimension>(edges);
}

/// Corner `k` of an element of a reference mesh; `get(n)` gives the position there of local node n.
template <int kDimension, class Get>
MESHSMOOTH_HD IdealCorner reference_corner(const ElementShape& shape, int k, bool some_flat,
                                           const Get& get) {
  if (some_flat && !(least_corner_share<kDimension>(shape, get) > kFlatShare)) {
    const double length = rms_edge(shape, get);
    return scaled_ideal(shape, length > 0 ? length : 1);
  }
  const CornerShape& corner = shape.corners[k];
  const Vec3d origin = get(corner.node);
  Vec3d edges[kDimension];
  for (int m = 0; m < kDimension; ++m) edges[m] = get(corner.neighbours[m]) - origin;
  return corner_of_edges<kDimension>(edges);
}

/// What corner `k` of an element aims at.
template <int kDimension>
MESHSMOOTH_HD IdealCorner corner_target(const Targets& targets, std::size_t e,
                                        const ElementView& element, int k) {
  const ElementShape& shape = *element.shape;
  if (targets.reference != nullptr) {
    return reference_corner<kDimension>(shape, k, targets.some_flat,
                                        [&](int n) { return targets.reference[element.nodes[n]]; });
  }
  if (targets.boxes == nullptr || is_simplex(shape)) return shape.ideal;
  return box_corner<kDimension>(shape, targets.boxes[e - targets.first_box], k);
}

}  // namespace meshsmooth::detail

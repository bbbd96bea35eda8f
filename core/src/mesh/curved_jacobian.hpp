#pragma once

#include <array>
#include <span>

#include "mesh/jacobian.hpp"
#include "meshsmooth/mesh.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::detail {

/// The sign of the Jacobian of an element of second order, everywhere in it and rounding included,
/// by the Bézier coefficients of the whole Jacobian: triangle6 6, quad8 and quad9 16,
/// tetrahedron10 20, wedges 90, pyramids 144, hexahedra 216. Where they do not tell, the element is
/// bisected.
///
/// Where a type has no nodes on its faces or in its middle, these points lie where the shape
/// functions of the serendipity element put them; a pyramid is a hexahedron with one face drawn to
/// a point.
///
/// Source: Johnen, Remacle, Geuzaine 2013, "Geometrical validity of curvilinear finite elements".
///
/// @param nodes      positions of all its nodes, in VTK's order
/// @param reference  of a surface element: the unit normal that it shall have, or zero: that of its
///                   corners
/// Thread-safe.
[[nodiscard]] JacobianSign curved_jacobian_sign(ElementType type, const Vec3d* nodes,
                                                Vec3d reference);

/// The Bézier coefficients of the Jacobian, in `coefficients` (at least `kMostJacobianCoefficients`
/// places). Each is linear in the position of every node. Parameters as above.
/// @returns their number
std::size_t jacobian_coefficients(ElementType type, const Vec3d* nodes, Vec3d reference,
                                  double* coefficients);
inline constexpr std::size_t kMostJacobianCoefficients = 216;

/// The same, and their gradients by the position of the element's node `node`. Of a surface element
/// the normal is held.
std::size_t jacobian_coefficients_at(std::size_t node, ElementType type, const Vec3d* nodes,
                                     Vec3d reference, double* coefficients, Vec3d* gradients);

/// @returns whether the nodes after the corners lie in the middle of their parts, to the rounding
/// of double: the element is what its corners are. Of a linear type: true.
[[nodiscard]] bool is_straight(ElementType type, const Vec3d* nodes);

/// The least scaled Jacobian in an element of second order: of the Jacobian over the product of the
/// lengths of the derivatives along the edges at a corner, of a simplex the longest such product at
/// each point; 1 in the ideal linear element. A lower bound, 0.003 below at most unless 256 parts
/// of the bisected element do not suffice. Of an element that is not valid, a value of at most 0
/// that it has somewhere.
///
/// Source: Johnen, Geuzaine, Toulorge, Remacle, "Quality measures for curvilinear finite elements",
/// of quads and hexahedra; of simplices Verdict's corner with the longest edges, at every point.
[[nodiscard]] double least_scaled_jacobian(ElementType type, const Vec3d* nodes, Vec3d reference);

/// Measures an element of any type: by its corners, but whether it is inverted and its scaled
/// Jacobian by the whole of it.
[[nodiscard]] ElementMeasure measure_nodes(ElementType type, const Vec3d* nodes, Vec3d reference);

/// @returns whether the Jacobian of an element of any type is positive everywhere
[[nodiscard]] bool is_valid(ElementType type, const Vec3d* nodes, Vec3d reference);

/// @returns the positions of an element's nodes
template <class Real>
[[nodiscard]] std::array<Vec3d, kMaxElementNodes> positions_of(
    std::span<const NodeId> nodes, std::span<const Vec3<Real>> positions) {
  std::array<Vec3d, kMaxElementNodes> result;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    result[n] = vec3_cast<double>(positions[static_cast<std::size_t>(nodes[n])]);
  }
  return result;
}

}  // namespace meshsmooth::detail

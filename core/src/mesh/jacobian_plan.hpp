#pragma once

#include <cstdint>
#include <vector>

#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// How the Bézier coefficients of the Jacobian of a type of second order follow from its nodes.
///
/// A polynomial is homogeneous in groups of barycentric coordinates: one group in a simplex, two in
/// a wedge or quad, three in a hexahedron. It is held by the coefficients of its monomials, so that
/// products add exponents and derivatives lower them.
struct JacobianPlan {
  struct Weight {
    std::uint16_t to, from;
    double by;
  };
  struct Product {
    std::uint16_t to, left, right;
  };
  /// Monomials that differ in two coordinates of a group only, by the exponent of the second.
  using Line = std::vector<std::uint16_t>;

  std::vector<Weight> control;  // coefficients of the position, from nodes
  std::size_t control_count = 0;
  std::vector<Weight> derivatives[3];        // from those coefficients
  std::vector<double> derivative_shares[3];  // of the Bézier coefficient in that of the monomial
  std::vector<Product> cross;                // of the last two derivatives
  std::size_t cross_count = 0;
  std::vector<Product> jacobian;         // of the first derivative and the cross product
  std::vector<double> shares;            // of the coefficients of the Jacobian
  std::vector<std::uint16_t> vertices;   // coefficients that are values at a vertex
  std::vector<std::vector<Line>> edges;  // for each edge along which the element may be bisected
};

/// @returns the plan of a type of second order; it lives as long as the program. Thread-safe.
[[nodiscard]] const JacobianPlan& jacobian_plan(ElementType type);

}  // namespace meshsmooth::detail

#pragma once

#include <array>
#include <cstddef>
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

  /// The derivative along an edge of the linear element.
  struct Direction {
    std::vector<Weight> weights;          // from the coefficients of the position
    std::vector<double> shares;           // as those of derivatives
    std::vector<std::uint16_t> vertices;  // its values where the Jacobian's `vertices` are
    std::vector<std::vector<Line>> edges;
  };

  /// The edges at a corner of the linear element; of parallel ones each once.
  struct Frame {
    std::vector<std::size_t> directions;
    /// Of the first direction's coefficients with the second's, and of these with the third's; the
    /// last are coefficients of the Jacobian.
    std::vector<std::vector<Product>> products;
  };

  std::vector<Weight> control;  // coefficients of the position, from nodes
  std::size_t control_count = 0;
  std::vector<Weight> derivatives[3];        // from those coefficients
  std::vector<double> derivative_shares[3];  // of the Bézier coefficient in that of the monomial
  std::vector<double> of_node[3];            // [nodes][coefficients of the derivative], by a node
  std::vector<Product> cross;                // of the last two derivatives
  std::size_t cross_count = 0;
  std::vector<Product> jacobian;         // of the first derivative and the cross product
  std::vector<double> shares;            // of the coefficients of the Jacobian
  std::vector<std::uint16_t> vertices;   // coefficients that are values at a vertex
  std::vector<std::vector<Line>> edges;  // for each edge along which the element may be bisected
  std::vector<Direction> directions;
  std::vector<Frame> frames;
};

/// Replaces a line of Bézier coefficients by those on one half of it, by de Casteljau's algorithm.
template <class Value>
void halve(const JacobianPlan::Line& line, bool upper, Value* at) {
  const std::size_t count = line.size();
  std::array<Value, 6> b;
  for (std::size_t k = 0; k < count; ++k) b[k] = at[line[upper ? count - 1 - k : k]];
  for (std::size_t round = 1; round < count; ++round) {
    for (std::size_t k = count - 1; k >= round; --k) b[k] = 0.5 * (b[k - 1] + b[k]);
  }
  for (std::size_t k = 0; k < count; ++k) at[line[upper ? count - 1 - k : k]] = b[k];
}

/// @returns the plan of a type of second order; it lives as long as the program. Thread-safe.
[[nodiscard]] const JacobianPlan& jacobian_plan(ElementType type);

}  // namespace meshsmooth::detail

#pragma once

#include "smooth/energy/ball_energy.hpp"

namespace meshsmooth::detail {

/// The scalar product of two gradients of a corner's shape functions; -1: that of its origin, which
/// is minus the sum of all.
template <int kDimension>
MESHSMOOTH_HD double product_of_gradients(const IdealCorner& corner, int a, int b) {
  double sum = 0;
  for (int c = 0; c < kDimension; ++c) {
    const auto of = [&](int m) {
      if (m >= 0) return corner.inverse[m][c];
      double rest = 0;
      for (int n = 0; n < kDimension; ++n) rest -= corner.inverse[n][c];
      return rest;
    };
    sum += of(a) * of(b);
  }
  return sum;
}

/// Calls `visit(local node, value)` for what a corner has in the matrix's row of the node with this
/// role, see `role_in_corner`. As in `add_stiffness` (laplace_matrix.hpp) all nodes of a simplex
/// are coupled, of other elements those that share an edge.
template <int kDimension, class Product, class Visitor>
MESHSMOOTH_HD void visit_couplings(const CornerShape& corner, bool simplex, int role,
                                   const Product& product, const Visitor& visit) {
  for (int m = -1; m < kDimension; ++m) {
    if (m == role) continue;
    const int node = m < 0 ? corner.node : corner.neighbours[m];
    if (simplex) {
      visit(node, product(role, m));
    } else if (m < 0 || role < 0) {
      const int end = m < 0 ? role : m;
      visit(node, -product(end, end));
    }
  }
}

/// How the energy of a mesh is differentiated.
struct MeshDerivatives {
  int power;    // of the energy
  double unit;  // of length, which keeps gradient and matrix in the range of single precision
};

/// The gradient of the mesh's energy at a node, and the node's row of a matrix like Laplace's that
/// comes near its Hessian. The energy of a corner, f^p with log f = log S - 2/d log D, bends with
/// |dT|^2 / S, by the gradients of shape functions in the target, and with (2/d) (d log D)^2 / 2,
/// by those in the current mesh, here shared evenly among the directions; the factor p covers
/// what p u u' adds (see `BallDerivatives`). Both times F = p w f^p.
template <int kDimension, class Real>
MESHSMOOTH_HD Vec3d differentiate_row(const Surroundings& around, const Vec3<Real>* positions,
                                      const MeshDerivatives& rule, std::size_t node, float* values,
                                      float* diagonal) {
  const NodeId* const ring = around.rings.begin(node);
  const std::size_t ring_size = around.rings.size(node);
  float* const row = values + around.rings.offsets[node];
  for (std::size_t n = 0; n < ring_size; ++n) row[n] = 0;
  const double scale = 2 * rule.power * rule.unit * rule.unit;
  const Vec3d origin = vec3_cast<double>(positions[node]);
  double sum = 0;
  Vec3d gradient{0, 0, 0};
  for (const ElementId* e = around.balls.begin(node); e != around.balls.end(node); ++e) {
    const ElementView element = around.elements[*e];
    const ElementShape& shape = *element.shape;
    const int own = local_node(element, static_cast<NodeId>(node));
    const auto get = [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]) - origin; };
    const auto add = [&](int n, double value) {
      std::size_t place = 0;
      while (place < ring_size && ring[place] != element.nodes[n]) ++place;
      if (place == ring_size) return;
      row[place] += static_cast<float>(value);
      sum -= value;
    };
    const bool simplex = is_simplex(shape);
    for (int k = simplex ? own : 0; k < (simplex ? own + 1 : shape.corner_count); ++k) {
      const CornerShape& corner = shape.corners[k];
      const int role = role_in_corner(corner, own, kDimension);
      if (role == 3) continue;
      const IdealCorner target = corner_target<kDimension>(around.targets, *e, element, k);
      const CornerTerm term =
          corner_term<kDimension>(shape, k, role, get, target, around.reference_of(*e));
      const CornerEnergy<kDimension> energy(term.volume, term.size, around.targets.certainty);
      const double share =
          rule.power * term.weight * raise(energy.stretch / kDimension, rule.power);
      gradient += share * ((1 / term.size) * term.size_gradient -
                           (2.0 / kDimension * energy.inverse.whole) * term.volume_gradient);
      Vec3d edges[kDimension];
      for (int m = 0; m < kDimension; ++m) {
        edges[m] = get(corner.neighbours[m]) - get(corner.node);
      }
      const IdealCorner lies = corner_of_edges<kDimension>(edges);
      const double by_size = scale * share / term.size;
      const double by_volume = scale * share / (kDimension * kDimension);
      visit_couplings<kDimension>(
          corner, simplex, role,
          [&](int a, int b) {
            return by_size * product_of_gradients<kDimension>(target, a, b) +
                   by_volume * product_of_gradients<kDimension>(lies, a, b);
          },
          add);
    }
  }
  diagonal[node] = static_cast<float>(sum);
  return rule.unit * gradient;
}

}  // namespace meshsmooth::detail

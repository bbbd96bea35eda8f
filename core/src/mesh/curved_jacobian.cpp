#include "mesh/curved_jacobian.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mesh/jacobian_plan.hpp"
#include "mesh/measure.hpp"

namespace meshsmooth::detail {
namespace {

constexpr int kMostParts = 1024;  // of a bisected element

using Coefficients = std::array<double, kMostJacobianCoefficients>;

/// Tells the sign of a Jacobian by bisecting the element.
class Signs {
 public:
  Signs(const JacobianPlan& plan, double bound) : plan_(plan), bound_(bound) {}

  JacobianSign of(const Coefficients& whole, std::size_t edge = 0) {
    const JacobianSign sign = by_coefficients(whole);
    if (sign != JacobianSign::unknown || ++parts_ > kMostParts) return sign;
    JacobianSign result = JacobianSign::positive;
    for (const bool upper : {false, true}) {
      Coefficients half;
      std::copy_n(whole.begin(), plan_.shares.size(), half.begin());
      for (const JacobianPlan::Line& line : plan_.edges[edge]) halve(line, upper, half.data());
      const JacobianSign of_half = of(half, (edge + 1) % plan_.edges.size());
      if (of_half == JacobianSign::negative_somewhere) return of_half;
      if (of_half == JacobianSign::unknown) result = of_half;
    }
    return result;
  }

 private:
  [[nodiscard]] JacobianSign by_coefficients(const Coefficients& all) const {
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(plan_.shares.size());
    if (std::all_of(all.begin(), end, [&](double c) { return c > bound_; })) {
      return JacobianSign::positive;
    }
    for (const std::uint16_t vertex : plan_.vertices) {
      if (all[vertex] < -bound_) return JacobianSign::negative_somewhere;
    }
    return JacobianSign::unknown;
  }

  const JacobianPlan& plan_;
  double bound_;
  int parts_ = 0;
};

/// What the coefficients of an element's Jacobian are products of.
class Factors {
 public:
  Factors(ElementType type, const Vec3d* nodes, Vec3d reference)
      : plan_(jacobian_plan(type)), volume_(element_shape(type).dimension == 3) {
    find_derivatives(nodes);
    clear(products_, plan_.cross_count);
    for (const JacobianPlan::Product& p : plan_.cross) {
      products_[p.to] += cross(left()[p.left], right()[p.right]);
    }
    if (!volume_) find_normal(element_shape(type), nodes, reference);
  }

  /// A bound of the rounding in a coefficient.
  [[nodiscard]] double bound() const { return bound_; }
  [[nodiscard]] std::size_t count() const { return plan_.shares.size(); }

  void coefficients(double* jacobian) const {
    std::fill_n(jacobian, count(), 0.0);
    if (volume_) {
      for (const JacobianPlan::Product& p : plan_.jacobian) {
        jacobian[p.to] += dot(derivatives_[0][p.left], products_[p.right]);
      }
    } else {
      for (std::size_t k = 0; k < count(); ++k) jacobian[k] = dot(products_[k], normal_);
    }
    for (std::size_t k = 0; k < count(); ++k) jacobian[k] *= plan_.shares[k];
  }

  /// The derivatives of the coefficients by the position of a node; the normal stays.
  void gradients(std::size_t node, Vec3d* gradients) const {
    Vectors turns;  // the products become their cross product with the node's move
    clear(turns, plan_.cross_count);
    const double* of_left = of_node(volume_ ? 1 : 0, node);
    const double* of_right = of_node(volume_ ? 2 : 1, node);
    for (const JacobianPlan::Product& p : plan_.cross) {
      turns[p.to] += of_left[p.left] * right()[p.right] - of_right[p.right] * left()[p.left];
    }
    std::fill_n(gradients, count(), Vec3d{0, 0, 0});
    if (volume_) {
      const double* of_first = of_node(0, node);
      for (const JacobianPlan::Product& p : plan_.jacobian) {
        gradients[p.to] +=
            of_first[p.left] * products_[p.right] + cross(turns[p.right], derivatives_[0][p.left]);
      }
    } else {
      for (std::size_t k = 0; k < count(); ++k) gradients[k] = cross(turns[k], normal_);
    }
    for (std::size_t k = 0; k < count(); ++k) gradients[k] = plan_.shares[k] * gradients[k];
  }

 private:
  using Vectors = std::array<Vec3d, 128>;  // only what is used is set

  static void clear(Vectors& vectors, std::size_t count) {
    std::fill_n(vectors.begin(), count, Vec3d{0, 0, 0});
  }
  [[nodiscard]] const Vectors& left() const { return derivatives_[volume_ ? 1 : 0]; }
  [[nodiscard]] const Vectors& right() const { return derivatives_[volume_ ? 2 : 1]; }
  [[nodiscard]] const double* of_node(int axis, std::size_t node) const {
    return plan_.of_node[axis].data() + node * plan_.derivative_shares[axis].size();
  }

  void find_derivatives(const Vec3d* nodes) {
    Vectors position;
    clear(position, plan_.control_count);
    for (const JacobianPlan::Weight& weight : plan_.control) {
      position[weight.to] += weight.by * (nodes[weight.from] - nodes[0]);
    }
    for (std::size_t axis = 0; axis < (volume_ ? 3 : 2); ++axis) {
      Vectors& derivative = derivatives_[axis];
      const std::vector<double>& shares = plan_.derivative_shares[axis];
      clear(derivative, shares.size());
      for (const JacobianPlan::Weight& weight : plan_.derivatives[axis]) {
        derivative[weight.to] += weight.by * position[weight.from];
      }
      double longest = 0;
      for (std::size_t k = 0; k < shares.size(); ++k) {
        longest = std::max(longest, shares[k] * norm(derivative[k]));
      }
      bound_ *= longest;
    }
  }

  void find_normal(const ElementShape& shape, const Vec3d* nodes, Vec3d reference) {
    normal_ = reference;
    if (dot(normal_, normal_) > 0) return;
    const CornerShape& corner = shape.corners[0];
    normal_ = cross(nodes[corner.neighbours[0]] - nodes[0], nodes[corner.neighbours[1]] - nodes[0]);
    normal_ = (1 / norm(normal_)) * normal_;
  }

  const JacobianPlan& plan_;
  bool volume_;
  std::array<Vectors, 3> derivatives_;
  Vectors products_;
  Vec3d normal_{0, 0, 0};
  double bound_ = 256 * std::numeric_limits<double>::epsilon();
};

}  // namespace

std::size_t jacobian_coefficients(ElementType type, const Vec3d* nodes, Vec3d reference,
                                  double* coefficients) {
  const Factors factors(type, nodes, reference);
  factors.coefficients(coefficients);
  return factors.count();
}

std::size_t jacobian_coefficients_at(std::size_t node, ElementType type, const Vec3d* nodes,
                                     Vec3d reference, double* coefficients, Vec3d* gradients) {
  const Factors factors(type, nodes, reference);
  factors.coefficients(coefficients);
  factors.gradients(node, gradients);
  return factors.count();
}

JacobianSign curved_jacobian_sign(ElementType type, const Vec3d* nodes, Vec3d reference) {
  const Factors factors(type, nodes, reference);
  Coefficients jacobian;
  factors.coefficients(jacobian.data());
  return Signs(jacobian_plan(type), factors.bound()).of(jacobian);
}

bool is_straight(ElementType type, const Vec3d* nodes) {
  const Vec3d* node = nodes + element_shape(type).node_count;
  for (const MidNode& mid : mid_nodes(type)) {
    Vec3d sum{0, 0, 0};
    double size = 0;
    for (int c = 0; c < mid.corner_count; ++c) {
      const Vec3d corner = nodes[mid.corners[static_cast<std::size_t>(c)]];
      sum += corner;
      size = std::max({size, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
    }
    const Vec3d away = *node++ - (1.0 / mid.corner_count) * sum;
    const double most = 4 * std::numeric_limits<double>::epsilon() * size;
    if (!(std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)}) <= most)) return false;
  }
  return true;
}

ElementMeasure measure_nodes(ElementType type, const Vec3d* nodes, Vec3d reference) {
  ElementMeasure measure = measure_element(element_shape(type), nodes, reference);
  if (is_straight(type, nodes)) return measure;
  const JacobianSign sign = curved_jacobian_sign(type, nodes, reference);
  measure.inverted = sign == JacobianSign::negative_somewhere;
  measure.degenerate = sign == JacobianSign::unknown;
  measure.scaled_jacobian = least_scaled_jacobian(type, nodes, reference);
  if (sign != JacobianSign::positive) {
    measure.scaled_jacobian = std::min(measure.scaled_jacobian, 0.0);
  }
  return measure;
}

bool is_valid(ElementType type, const Vec3d* nodes, Vec3d reference) {
  if (!is_straight(type, nodes)) {
    return curved_jacobian_sign(type, nodes, reference) == JacobianSign::positive;
  }
  const ElementMeasure measure = measure_element(element_shape(type), nodes, reference);
  return !measure.inverted && !measure.degenerate;
}

}  // namespace meshsmooth::detail

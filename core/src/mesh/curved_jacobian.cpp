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
using Vectors = std::array<Vec3d, 128>;

/// A line of Bézier coefficients on one half of it, by de Casteljau's algorithm.
void halve(const JacobianPlan::Line& line, bool upper, double* at) {
  const std::size_t count = line.size();
  std::array<double, 6> b{};
  for (std::size_t k = 0; k < count; ++k) b[k] = at[line[upper ? count - 1 - k : k]];
  for (std::size_t round = 1; round < count; ++round) {
    for (std::size_t k = count - 1; k >= round; --k) b[k] = (b[k - 1] + b[k]) / 2;
  }
  for (std::size_t k = 0; k < count; ++k) at[line[upper ? count - 1 - k : k]] = b[k];
}

/// Tells the sign of a Jacobian by bisecting the element.
class Signs {
 public:
  Signs(const JacobianPlan& plan, double bound) : plan_(plan), bound_(bound) {}

  JacobianSign of(const Coefficients& whole, std::size_t edge = 0) {
    const JacobianSign sign = by_coefficients(whole);
    if (sign != JacobianSign::unknown || ++parts_ > kMostParts) return sign;
    JacobianSign result = JacobianSign::positive;
    for (const bool upper : {false, true}) {
      Coefficients half = whole;
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

/// @returns a bound of the rounding in a coefficient
double find_coefficients(ElementType type, const Vec3d* nodes, Vec3d reference,
                         Coefficients& jacobian) {
  const JacobianPlan& plan = jacobian_plan(type);
  const bool volume = element_shape(type).dimension == 3;
  Vectors position{};
  for (const JacobianPlan::Weight& weight : plan.control) {
    position[weight.to] += weight.by * (nodes[weight.from] - nodes[0]);
  }
  std::array<Vectors, 3> derivatives{};
  double bound = 256 * std::numeric_limits<double>::epsilon();
  for (int axis = 0; axis < (volume ? 3 : 2); ++axis) {
    for (const JacobianPlan::Weight& weight : plan.derivatives[axis]) {
      derivatives[axis][weight.to] += weight.by * position[weight.from];
    }
    double longest = 0;
    for (std::size_t k = 0; k < plan.derivative_shares[axis].size(); ++k) {
      longest = std::max(longest, plan.derivative_shares[axis][k] * norm(derivatives[axis][k]));
    }
    bound *= longest;
  }
  Vectors products{};
  const int last = volume ? 2 : 1;
  for (const JacobianPlan::Product& p : plan.cross) {
    products[p.to] += cross(derivatives[last - 1][p.left], derivatives[last][p.right]);
  }
  if (volume) {
    for (const JacobianPlan::Product& p : plan.jacobian) {
      jacobian[p.to] += dot(derivatives[0][p.left], products[p.right]);
    }
  } else {
    Vec3d normal = reference;
    if (!(dot(normal, normal) > 0)) {
      const CornerShape& corner = element_shape(type).corners[0];
      normal =
          cross(nodes[corner.neighbours[0]] - nodes[0], nodes[corner.neighbours[1]] - nodes[0]);
      normal = (1 / norm(normal)) * normal;
    }
    for (std::size_t k = 0; k < plan.cross_count; ++k) jacobian[k] = dot(products[k], normal);
  }
  for (std::size_t k = 0; k < plan.shares.size(); ++k) jacobian[k] *= plan.shares[k];
  return bound;
}

}  // namespace

std::size_t jacobian_coefficients(ElementType type, const Vec3d* nodes, Vec3d reference,
                                  double* coefficients) {
  Coefficients found{};
  find_coefficients(type, nodes, reference, found);
  const std::size_t count = jacobian_plan(type).shares.size();
  std::copy_n(found.begin(), count, coefficients);
  return count;
}

JacobianSign curved_jacobian_sign(ElementType type, const Vec3d* nodes, Vec3d reference) {
  Coefficients jacobian{};
  const double bound = find_coefficients(type, nodes, reference, jacobian);
  return Signs(jacobian_plan(type), bound).of(jacobian);
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
  return measure;
}

}  // namespace meshsmooth::detail

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <functional>
#include <queue>
#include <vector>

#include "mesh/curved_jacobian.hpp"
#include "mesh/jacobian_plan.hpp"

namespace meshsmooth::detail {
namespace {

constexpr double kTolerance = 2e-3;
constexpr int kMostParts = 256;  // of a bisected element

using Coefficients = std::array<double, kMostJacobianCoefficients>;

/// The Bézier coefficients of the Jacobian on a part of the element, and of its derivatives along
/// the edges.
struct Part {
  Coefficients jacobian;
  std::array<std::array<Vec3d, 18>, 6> derivatives;
};

class LeastScaledJacobian {
 public:
  explicit LeastScaledJacobian(const JacobianPlan& plan) : plan_(plan) {}

  /// @returns a lower bound, by no more than the tolerance unless there are too many parts; of a
  /// Jacobian that is not positive everywhere, some value there
  double of(const Part& whole) {
    // The part with the lowest bound first. Kept from element to element: of such sizes the
    // allocator asks the system each time, which stops all threads.
    thread_local std::vector<Part> parts;
    parts.assign(1, whole);
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.push(examine(whole, 0, 0));
    while (true) {
      const Entry lowest = queue.top();
      const bool done = least_ <= 0 || lowest.bound >= least_ - kTolerance;
      if (done || parts.size() >= kMostParts) {
        return least_ > 0 ? std::clamp(lowest.bound, 0.0, least_) : least_;
      }
      queue.pop();
      const std::size_t next = (lowest.edge + 1) % plan_.edges.size();
      parts.push_back(half_of(parts[lowest.part], lowest.edge, true));
      queue.push(examine(parts.back(), parts.size() - 1, next));
      parts[lowest.part] = half_of(parts[lowest.part], lowest.edge, false);
      queue.push(examine(parts[lowest.part], lowest.part, next));
    }
  }

 private:
  struct Entry {
    double bound;
    std::size_t part, edge;  // along which it is cut next
    auto operator<=>(const Entry&) const = default;
  };

  Entry examine(const Part& part, std::size_t index, std::size_t edge) {
    visit_vertices(part);
    return {bound_by_coefficients(part), index, edge};
  }

  void visit_vertices(const Part& part) {
    for (std::size_t v = 0; v < plan_.vertices.size(); ++v) {
      double longest = 0;
      for (const JacobianPlan::Frame& frame : plan_.frames) {
        double product = 1;
        for (const std::size_t d : frame.directions) {
          product *= norm(part.derivatives[d][plan_.directions[d].vertices[v]]);
        }
        longest = std::max(longest, product);
      }
      const double jacobian = part.jacobian[plan_.vertices[v]];
      least_ = std::min(least_, longest > 0 ? jacobian / longest : 0.0);
    }
  }

  /// A vector is no longer than the polynomial with the lengths of its coefficients: the Jacobian
  /// is at least as many times a product of such polynomials as each coefficient is.
  [[nodiscard]] double bound_by_coefficients(const Part& part) const {
    const std::size_t count = plan_.shares.size();
    if (!std::all_of(part.jacobian.begin(),
                     part.jacobian.begin() + static_cast<std::ptrdiff_t>(count),
                     [](double c) { return c > 0; })) {
      return -1;
    }
    std::array<std::array<double, 18>, 6> lengths;  // coefficients of monomials
    for (std::size_t d = 0; d < plan_.directions.size(); ++d) {
      const std::vector<double>& shares = plan_.directions[d].shares;
      for (std::size_t k = 0; k < shares.size(); ++k) {
        lengths[d][k] = norm(part.derivatives[d][k]) / shares[k];
      }
    }
    double bound = least_;
    for (const JacobianPlan::Frame& frame : plan_.frames) {
      Coefficients product;
      std::copy_n(lengths[frame.directions[0]].begin(), 18, product.begin());
      for (std::size_t d = 1; d < frame.directions.size(); ++d) {
        Coefficients next{};
        for (const JacobianPlan::Product& p : frame.products[d - 1]) {
          next[p.to] += product[p.left] * lengths[frame.directions[d]][p.right];
        }
        product = next;
      }
      for (std::size_t k = 0; k < count; ++k) {
        bound = std::min(bound, part.jacobian[k] / (plan_.shares[k] * product[k]));
      }
    }
    return bound;
  }

  [[nodiscard]] Part half_of(const Part& part, std::size_t edge, bool upper) const {
    Part half;
    std::copy_n(part.jacobian.begin(), plan_.shares.size(), half.jacobian.begin());
    for (const JacobianPlan::Line& line : plan_.edges[edge]) {
      halve(line, upper, half.jacobian.data());
    }
    for (std::size_t d = 0; d < plan_.directions.size(); ++d) {
      const JacobianPlan::Direction& direction = plan_.directions[d];
      std::copy_n(part.derivatives[d].begin(), direction.shares.size(),
                  half.derivatives[d].begin());
      for (const JacobianPlan::Line& line : direction.edges[edge]) {
        halve(line, upper, half.derivatives[d].data());
      }
    }
    return half;
  }

  const JacobianPlan& plan_;
  double least_ = 1e300;  // that was found
  int parts_ = 0;
};

}  // namespace

double least_scaled_jacobian(ElementType type, const Vec3d* nodes, Vec3d reference) {
  const JacobianPlan& plan = jacobian_plan(type);
  Part whole;
  jacobian_coefficients(type, nodes, reference, whole.jacobian.data());
  std::array<Vec3d, 27> position;
  position.fill({0, 0, 0});
  for (const JacobianPlan::Weight& weight : plan.control) {
    position[weight.to] += weight.by * (nodes[weight.from] - nodes[0]);
  }
  for (std::size_t d = 0; d < plan.directions.size(); ++d) {
    const JacobianPlan::Direction& direction = plan.directions[d];
    auto& derivative = whole.derivatives[d];
    derivative.fill({0, 0, 0});
    for (const JacobianPlan::Weight& weight : direction.weights) {
      derivative[weight.to] += weight.by * position[weight.from];
    }
    for (std::size_t k = 0; k < direction.shares.size(); ++k) {
      derivative[k] = direction.shares[k] * derivative[k];
    }
  }
  return LeastScaledJacobian(plan).of(whole) / element_shape(type).ideal.determinant;
}

}  // namespace meshsmooth::detail

// Energy, gradient and Hessian of a ball, against the textbook and finite differences.

#include "smooth/energy/ball_energy.hpp"

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "smooth/optimize/optimize_rule.hpp"
#include "support/descent.hpp"

namespace meshsmooth {
namespace {

using namespace detail;
using test::points;
using test::oracle::Descent;
using test::oracle::Point;
using test::oracle::Points;

/// What surrounds the nodes of a mesh, in the caller's ids.
class Around {
 public:
  explicit Around(const Mesh& mesh) : mesh_(mesh), offsets_(1, 0) {
    for (const ElementBlock& block : mesh_.blocks) {
      elements_.runs[elements_.run_count++] = {&element_shape(block.type), block.nodes.data(),
                                               elements_.count};
      elements_.count += block.nodes.size() / test::ideal_points(block.type).size();
    }
    for (const auto& ball : test::oracle::balls(mesh_)) {
      for (const std::int64_t e : ball) entries_.push_back(static_cast<ElementId>(e));
      offsets_.push_back(static_cast<std::int64_t>(entries_.size()));
    }
  }

  [[nodiscard]] Surroundings view() const {
    const bool surface = elements_.runs[0].shape->dimension == 2;
    return {mesh_.node_count(),
            elements_,
            {},
            {offsets_.data(), entries_.data()},
            nullptr,
            nullptr,
            {0, 0, surface ? 1.0 : 0.0},
            nullptr,
            {},
            targets_};
  }
  void aim(const Targets& targets) { targets_ = targets; }
  [[nodiscard]] QuietPositions<double> positions() const { return {test::points(mesh_).data()}; }
  void place(std::size_t node, Vec3d p) { test::points(mesh_)[node] = p; }

 private:
  Mesh mesh_;
  Elements elements_{};
  std::vector<std::int64_t> offsets_;
  std::vector<ElementId> entries_;
  Targets targets_;
};

template <int kDimension, class Body>
void with_terms(const Around& around, std::size_t node, const Body& body) {
  const Surroundings view = around.view();
  const auto x = around.positions();
  const SingleThread team;
  const BallTerms<kDimension, 64, SingleThread, QuietPositions<double>> terms(team, view, x, node,
                                                                              view.reference);
  body(terms);
}

template <int kDimension>
BallDerivatives derivatives(const Around& around, std::size_t node, const BallEnergy& energy) {
  BallDerivatives result;
  with_terms<kDimension>(around, node, [&](const auto& terms) {
    result = differentiate<kDimension>(SingleThread{}, terms, energy);
  });
  return result;
}

Eigen::Matrix3d matrix(const BallDerivatives& at) {
  Eigen::Matrix3d m;
  m << at.xx, at.xy, at.xz, at.xy, at.yy, at.yz, at.xz, at.yz, at.zz;
  return m;
}
Point to_point(Vec3d v) { return {v.x, v.y, v.z}; }
Vec3d to_vec(const Point& p) { return {p.x(), p.y(), p.z()}; }

Mesh noisy(ElementType type) { return test::noisy(test::lattice(type, 3), 0.17, 4); }

/// Gradient and Hessian at a node against finite differences; strictly convex.
template <int kDimension>
void expect_differences(Around& around, std::size_t node, const Point& home,
                        const BallEnergy& energy) {
  const int power = energy.power;
  const BallDerivatives at = derivatives<kDimension>(around, node, energy);
  const double h = 1e-5;
  Point slope = Point::Zero();
  Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();
  for (int k = 0; k < kDimension; ++k) {
    const Point step = h * Point::Unit(k);
    const auto value = [&](double sign) {
      double found = 0;
      with_terms<kDimension>(around, node, [&](const auto& terms) {
        found = energy_at<kDimension>(SingleThread{}, terms, energy, to_vec(sign * step), true);
      });
      return found;
    };
    slope[k] = (value(1) - value(-1)) / (2 * h);
    const auto gradient = [&](double sign) {
      around.place(node, to_vec(home + sign * step));
      const Point found = to_point(derivatives<kDimension>(around, node, energy).gradient);
      around.place(node, to_vec(home));
      return found;
    };
    curvature.col(k) = (gradient(1) - gradient(-1)) / (2 * h);
  }
  const Point exact =
      power * to_point(at.gradient).cwiseProduct(Point(1, 1, kDimension == 3 ? 1 : 0));
  EXPECT_LT((slope - exact).norm(), 1e-6 * (exact.norm() + at.energy));
  const Eigen::Matrix3d hessian = matrix(at);
  const Eigen::MatrixXd found = curvature.topLeftCorner(kDimension, kDimension);
  const Eigen::MatrixXd told = hessian.topLeftCorner(kDimension, kDimension);
  EXPECT_LT((found - told).norm(), 1e-6 * told.norm());
  // Strictly convex where the ball is valid.
  EXPECT_GT(told.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0);
}

template <int kDimension>
void expect_true_derivatives(const std::string& name, const Mesh& mesh, int power) {
  Around around(mesh);
  const Descent textbook(mesh, power);
  const Points x = test::oracle::to_points(mesh);
  const std::vector<bool> held = test::oracle::held_nodes(mesh);
  const BallEnergy energy{.power = power};
  int compared = 0;
  for (std::size_t node = 0; node < x.size(); ++node) {
    if (held[node]) continue;
    SCOPED_TRACE(name + " node " + std::to_string(node) + " p " + std::to_string(power));
    const BallDerivatives at = derivatives<kDimension>(around, node, energy);
    const auto truth = textbook.energy(static_cast<NodeId>(node), x);
    ASSERT_TRUE(std::isfinite(truth.value));
    ++compared;

    EXPECT_NEAR(at.energy, truth.value, 1e-12 * truth.value);
    EXPECT_LT((power * to_point(at.gradient) - truth.gradient).norm(),
              1e-11 * (truth.gradient.norm() + truth.value));
    expect_differences<kDimension>(around, node, x[node], energy);
  }
  EXPECT_GT(compared, 0) << name;
}

TEST(BallEnergy, HasTheTextbooksValueGradientAndHessian) {
  for (const int power : {1, 2, 4, 32}) {
    for (const ElementType type : kLinearTypes) {
      const std::string name(element_name(type));
      test::oracle::is_surface(type) ? expect_true_derivatives<2>(name, noisy(type), power)
                                     : expect_true_derivatives<3>(name, noisy(type), power);
    }
    expect_true_derivatives<3>("mixed", test::noisy(test::mixed_stack(3), 0.12, 4), power);
  }
}

/// Every element aims at another random shape.
template <int kDimension>
void expect_true_derivatives_against_random_targets(const Mesh& mesh, unsigned seed) {
  const Mesh reference = test::noisy(mesh, 0.1, seed);
  ASSERT_EQ(measure_quality(reference).inverted_count, 0);
  Around around(mesh);
  around.aim({.reference = points(reference).data()});
  const Points x = test::oracle::to_points(mesh);
  const std::vector<bool> held = test::oracle::held_nodes(mesh);
  for (std::size_t node = 0; node < x.size(); ++node) {
    if (held[node]) continue;
    for (const int power : {1, 2, 4}) {
      expect_differences<kDimension>(around, node, x[node], {.power = power});
    }
  }
}

TEST(BallEnergy, HasTheGradientAndHessianOfFiniteDifferencesForRandomTargets) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const ElementType type : kLinearTypes) {
      SCOPED_TRACE(element_name(type));
      const Mesh mesh = test::noisy(test::lattice(type, 3), 0.1, seed + 100);
      test::oracle::is_surface(type)
          ? expect_true_derivatives_against_random_targets<2>(mesh, seed)
          : expect_true_derivatives_against_random_targets<3>(mesh, seed);
    }
  }
}

TEST(BallEnergy, WithEpsilonHasTheGradientAndAPositiveDefiniteMatrix) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    const Mesh mesh = test::noisy(test::lattice(type, 3), 0.7, 4);
    Around around(mesh);
    const std::vector<bool> held = test::oracle::held_nodes(mesh);
    int tangled = 0;
    for (std::size_t node = 0; node < mesh.node_count(); ++node) {
      if (held[node]) continue;
      with_terms<3>(around, node, [&](const auto& terms) {
        const BallScan scan = scan_ball<3>(SingleThread{}, terms, false);
        if (scan.valid) return;
        ++tangled;
        const BallEnergy energy{.power = 1, .epsilon_squared = epsilon_squared<3>(scan, 0)};
        const BallDerivatives at = differentiate<3>(SingleThread{}, terms, energy);
        const double h = 1e-6;
        Point slope;
        for (int k = 0; k < 3; ++k) {
          const auto value = [&](double s) {
            return energy_at<3>(SingleThread{}, terms, energy, to_vec(s * Point::Unit(k)), false);
          };
          slope[k] = (value(h) - value(-h)) / (2 * h);
        }
        EXPECT_LT((slope - to_point(at.gradient)).norm(), 1e-5 * to_point(at.gradient).norm());
        EXPECT_GT(matrix(at).selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0);
      });
    }
    EXPECT_GT(tangled, 5);
  }
}

TEST(NewtonStep, SolvesTheNormalEquations) {
  const Mesh mesh = noisy(ElementType::tetrahedron);
  const Around around(mesh);
  const std::vector<bool> held = test::oracle::held_nodes(mesh);
  for (std::size_t node = 0; node < mesh.node_count(); ++node) {
    if (held[node]) continue;
    const BallDerivatives at = derivatives<3>(around, node, {.power = 2});
    const Point exact = -matrix(at).ldlt().solve(to_point(at.gradient));

    const NewtonStep step = newton_step(at);

    EXPECT_LT((to_point(step.direction) - exact).norm(), 1e-10 * exact.norm());
    EXPECT_NEAR(step.decrement, -exact.dot(to_point(at.gradient)) / at.energy, 1e-12);
    // In a plane: the least of the model among the steps in it.
    const Point normal = Point(1, -2, 0.5).normalized();
    const NewtonStep flat = newton_step_in_plane(at, to_vec(normal));
    EXPECT_NEAR(to_point(flat.direction).dot(normal), 0, 1e-15);
    const Point rest = matrix(at) * to_point(flat.direction) + to_point(at.gradient);
    EXPECT_LT((rest - rest.dot(normal) * normal).norm(), 1e-9 * to_point(at.gradient).norm());
  }
}

}  // namespace
}  // namespace meshsmooth

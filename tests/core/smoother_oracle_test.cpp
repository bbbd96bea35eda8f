// Sweeps compared with the slow and obvious version.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "smooth/rules/colouring_rule.hpp"

namespace meshsmooth {
namespace {

using test::difference;
using test::Job;
using test::sweeps;
using test::oracle::Points;
using test::oracle::Slow;
using test::oracle::to_points;

/// Valid meshes of every kind with free nodes, noisy.
std::vector<std::pair<std::string, Mesh>> noisy_meshes() {
  std::vector<std::pair<std::string, Mesh>> meshes;
  for (const ElementType type : kElementTypes) {
    meshes.emplace_back(element_shape(type).name, test::noisy(test::lattice(type, 5), 0.12, 11));
  }
  meshes.emplace_back("mixed", test::noisy(test::mixed_stack(4), 0.12, 12));
  meshes.emplace_back("ring", test::triangle_ring());
  meshes.emplace_back("ball", test::with_isolated_node(test::tet_ball()));
  meshes.emplace_back("sphere", test::noisy(test::sphere(3), 0.02, 13));
  Mesh masked = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.12, 14);
  for (std::size_t n = 0; n < masked.node_count(); ++n) masked.fixed.push_back(n % 3 == 0 ? 1 : 0);
  meshes.emplace_back("masked", masked);
  return meshes;
}

/// Smart averaging in Jacobi form has no formula node by node: moves are cut
/// back together; the optimizer goes down an energy. Their promises are tested instead.
std::vector<test::Way> ways_with_formula() {
  std::vector<test::Way> ways = test::ways(false);
  std::erase_if(ways, [](const test::Way& way) {
    return std::holds_alternative<Optimize>(way.method) ||
           (std::holds_alternative<SmartLaplacian>(way.method) && way.form == Form::jacobi);
  });
  return ways;
}

class EveryMethod : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Sweep, EveryMethod, testing::ValuesIn(ways_with_formula()),
                         test::way_name);

TEST_P(EveryMethod, MovesNodesAsTheFormulaSays) {
  const auto& [way, method, form] = GetParam();
  const auto* const smart = std::get_if<SmartLaplacian>(&method);
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (smart != nullptr && name == "sphere") continue;  // the oracle's quality is plane
    const Slow slow(mesh);
    const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
    for (const int count : {1, 3}) {
      const Points start = to_points(mesh);
      Points expected = start;
      for (int sweep = 0; sweep < count; ++sweep) {
        if (smart != nullptr) {
          expected = slow.sweep_smart(smart->weighting, smart->relaxation, order, expected);
        } else if (form == Form::jacobi) {
          expected = slow.sweep(method, start, expected);
        } else if (const auto* m = std::get_if<Laplacian>(&method)) {
          expected = slow.sweep_in_place(m->weighting, m->relaxation, order, expected);
        } else {
          const auto& taubin = std::get<Taubin>(method);
          for (const double factor : {taubin.lambda, taubin.mu}) {
            expected = slow.sweep_in_place(Weighting::uniform, factor, order, expected);
          }
        }
      }

      const Job job = test::smooth(mesh, sweeps(count, method, form));
      const Job rounded = test::smooth(test::as_float32(mesh), sweeps(count, method, form));

      EXPECT_LT(difference(job.mesh, expected), 1e-13) << name << ", " << count << " sweeps";
      if (smart == nullptr) {  // else a rounding may take another move
        EXPECT_LT(difference(rounded.mesh, expected), 1e-6) << name << ", " << count << " sweeps";
      }
      EXPECT_GT(difference(job.mesh, start), 1e-3) << name << ": nothing has moved";
    }
  }
}

TEST(Sweep, KnowsTheFreeNodeOfABallByHand) {
  const Job job = test::smooth(test::tet_ball(), sweeps(1, Laplacian{}));

  EXPECT_EQ(test::points(job.mesh)[6], (Vec3d{0, 0, 0}));
  EXPECT_DOUBLE_EQ(job.summary.convergence.last_max_displacement, norm(Vec3d{0.2, 0.1, -0.15}));
}

TEST(Sweep, GoesTheShareOfTheWayThatRelaxationSays) {
  const Job job = test::smooth(test::tet_ball(), sweeps(1, Laplacian{.relaxation = 0.25}));

  EXPECT_NEAR(norm(test::points(job.mesh)[6] - Vec3d{0.15, 0.075, -0.1125}), 0, 1e-16);
}

TEST(Sweep, MovesTheBoundaryWhenItIsFree) {
  for (const ElementType type : kElementTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 3), 0.1, 4);
    SmoothOptions options = sweeps(2, Laplacian{.relaxation = 0.3});
    options.boundary = BoundaryPolicy::free;
    const Slow slow(mesh, false);
    const Points start = to_points(mesh);

    const Job job = test::smooth(mesh, options);

    EXPECT_LT(difference(job.mesh, slow.sweep(options.method, start,
                                              slow.sweep(options.method, start, start))),
              1e-13)
        << element_shape(type).name;
    EXPECT_EQ(job.summary.nodes.fixed, 0);
  }
}

class ConvergedLaplacian : public testing::TestWithParam<Form> {};
INSTANTIATE_TEST_SUITE_P(Forms, ConvergedLaplacian,
                         testing::Values(Form::jacobi, Form::gauss_seidel, Form::asynchronous));

TEST_P(ConvergedLaplacian, IsTheSolutionOfTheSparseSystem) {
  SmoothOptions options{.method = Laplacian{},
                        .form = GetParam(),
                        .max_iterations = 100000,
                        .tolerance = {1e-13},
                        .guard = false};
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (name == "sphere") continue;  // without a boundary there is nothing to hold it
    const Points expected = Slow(mesh).solve(to_points(mesh));

    const Job job = test::smooth(mesh, options);

    EXPECT_EQ(job.summary.stop_reason, StopReason::converged) << name;
    EXPECT_LT(difference(job.mesh, expected), 1e-9) << name;
  }
}

TEST_P(ConvergedLaplacian, IsTheSolutionInFloat32ToItsPrecision) {
  SmoothOptions options{.method = Laplacian{},
                        .form = GetParam(),
                        .max_iterations = 100000,
                        .tolerance = {1e-7},
                        .guard = false};
  for (const auto& [name, mesh] : noisy_meshes()) {
    if (name == "sphere") continue;
    const Points expected = Slow(mesh).solve(to_points(mesh));

    const Job job = test::smooth(test::as_float32(mesh), options);

    EXPECT_LT(difference(job.mesh, expected), 1e-5) << name;
  }
}

TEST(Taubin, KeepsASphereThatTheLaplacianShrinks) {
  const Mesh mesh = test::noisy(test::sphere(4), 0.01, 1);
  const auto radius = [](const Mesh& m) {
    double sum = 0;
    for (const Vec3d& p : test::points(m)) sum += norm(p);
    return sum / static_cast<double>(m.node_count());
  };

  const double shrunk = radius(test::smooth(mesh, sweeps(20, Laplacian{})).mesh);
  const double taubin = radius(test::smooth(mesh, sweeps(20, Taubin{})).mesh);
  const double hc = radius(test::smooth(mesh, sweeps(20, HcLaplacian{})).mesh);

  EXPECT_LT(shrunk, 0.97);
  EXPECT_NEAR(taubin, radius(mesh), 0.01);
  EXPECT_NEAR(hc, radius(mesh), 0.01);
}

}  // namespace
}  // namespace meshsmooth

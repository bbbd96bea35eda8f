// Boundary nodes that go onto a target surface and slide along it.

#include <gtest/gtest.h>

#include "core/fit_cases.hpp"
#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/surface_of.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using test::box_mesh;
using test::box_surface;
using test::Job;
using test::on;
using test::points;
using test::sliding;

void expect_valid(const SmoothSummary& summary) {
  EXPECT_EQ(summary.quality_after.inverted_count, 0);
  EXPECT_EQ(summary.quality_after.degenerate_count, 0);
}

void expect_all_reached(const SmoothSummary& summary) {
  ASSERT_TRUE(summary.fit);
  EXPECT_EQ(summary.fit->reached_count, summary.fit->node_count);
  EXPECT_EQ(summary.fit->held_count, 0);
  EXPECT_EQ(summary.fit->unmatched_corner_count, 0);
  EXPECT_EQ(summary.fit->unmatched_curve_count, 0);
  EXPECT_LT(summary.fit->result_to_surface.largest, 1e-12);
}

/// How many nodes have as many coordinates at 0 or 1.
int count_at_sides(const Mesh& mesh, int sides) {
  int count = 0;
  for (const Vec3d& p : test::points_as_double(mesh)) {
    const auto side = [](double x) { return x == 0 || x == 1 ? 1 : 0; };
    count += side(p.x) + side(p.y) + side(p.z) == sides ? 1 : 0;
  }
  return count;
}

class FitOfType : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Fit, FitOfType,
                         testing::Values(ElementType::hexahedron, ElementType::tetrahedron,
                                         ElementType::wedge, ElementType::pyramid));

TEST_P(FitOfType, GivesABoxItsCornersEdgesAndSides) {
  const int n = 4;
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  const Job job = test::smooth(box_mesh(GetParam(), n, 0.03, 0.95), sliding(), on(surface));
  expect_valid(job.summary);
  expect_all_reached(job.summary);
  EXPECT_TRUE(job.summary.fit->input_off_surface);
  EXPECT_EQ(count_at_sides(job.mesh, 3), 8);
  EXPECT_GE(count_at_sides(job.mesh, 2), 12 * (n - 1));
  EXPECT_LT(job.summary.fit->surface_to_result.largest, 1e-12);
}

TEST(Fit, KeepsTheConcaveEdgeOfAnLShape) {
  const SurfaceMesh surface = test::l_surface(4);
  const Job job = test::smooth(test::l_mesh(3), sliding(), on(surface));
  expect_valid(job.summary);
  expect_all_reached(job.summary);
  EXPECT_EQ(job.summary.fit->surface.corners, 12);
  EXPECT_LT(job.summary.fit->surface_to_result.largest, 1e-12);
}

TEST(Fit, BringsAVoxelCubeOntoASphere) {
  const SurfaceMesh surface = test::sphere_surface(24, 1);
  const Job job =
      test::smooth(box_mesh(ElementType::hexahedron, 6, -0.7, 0.7), sliding(), on(surface));
  expect_valid(job.summary);
  expect_all_reached(job.summary);
  double nearest = 2;
  for (const Vec3d& p : test::points_as_double(job.mesh)) {
    EXPECT_LE(norm(p), 1 + 1e-12);
    nearest = std::min(nearest, norm(p));
  }
  EXPECT_GT(test::scaled_jacobian(job.summary.quality_after).min, 0);
}

TEST(Fit, SlidesNodesThatLieOnTheSurface) {
  const SurfaceMesh surface = box_surface(2, {1, 1, 1});
  const Job job = test::smooth(test::thrown_box_mesh(), sliding(), on(surface));
  expect_valid(job.summary);
  expect_all_reached(job.summary);
  EXPECT_FALSE(job.summary.fit->input_off_surface);
  EXPECT_GT(test::mean_ratio(job.summary.quality_after).min, 0.99);
}

TEST(Fit, TakesASurfaceThatIsInsideOut) {
  SurfaceMesh surface = box_surface(3, {1, 1, 1});
  for (auto& t : surface.triangles) std::swap(t[0], t[1]);
  const Job job =
      test::smooth(box_mesh(ElementType::hexahedron, 4, 0.03, 0.95), sliding(), on(surface));
  expect_valid(job.summary);
  expect_all_reached(job.summary);
}

TEST(Fit, StaysValidOnASurfaceWithAHole) {
  const SurfaceMesh surface = test::sphere_with_hole();
  SmoothOptions options = sliding();
  options.max_iterations = 30;
  const Job job =
      test::smooth(box_mesh(ElementType::hexahedron, 5, -0.6, 0.6), options, on(surface));
  expect_valid(job.summary);
  EXPECT_GT(job.summary.fit->surface.open_edges, 0);
}

TEST(Fit, StaysValidOnAFoldedSurface) {
  const SurfaceMesh surface = test::folded_surface();
  const Job job =
      test::smooth(box_mesh(ElementType::hexahedron, 6, 0.03, 0.95), sliding(), on(surface));
  expect_valid(job.summary);
  EXPECT_GT(job.summary.fit->surface.patches, 1000);
  EXPECT_TRUE(job.summary.fit->parts.empty()) << "a summary must fit in a message";
  EXPECT_EQ(job.summary.fit->reached_count + job.summary.fit->held_count,
            job.summary.fit->node_count);
}

TEST(Fit, StaysValidOnASurfaceFarAway) {
  SurfaceMesh surface = test::sphere_surface(12, 1);
  for (Vec3d& p : surface.points) p = p + Vec3d{7, 0, 0};
  const Job job =
      test::smooth(box_mesh(ElementType::hexahedron, 4, -0.6, 0.6), sliding(), on(surface));
  expect_valid(job.summary);
  EXPECT_EQ(job.summary.fit->reached_count + job.summary.fit->held_count,
            job.summary.fit->node_count);
}

TEST(Fit, HoldsTheNodesThatTheCallerFixed) {
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  Mesh mesh = box_mesh(ElementType::hexahedron, 4, 0.03, 0.95);
  const Mesh before = mesh;
  mesh.fixed.assign(mesh.node_count(), 0);
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    if (points(mesh)[n].x < 0.1) mesh.fixed[n] = 1;
  }
  const Job job = test::smooth(mesh, sliding(), on(surface));
  expect_valid(job.summary);
  EXPECT_EQ(job.summary.fit->fixed_count, 25);
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    if (mesh.fixed[n] != 0) {
      EXPECT_EQ(points(job.mesh)[n], points(before)[n]);
    }
  }
}

/// Elements of positive quality.
std::vector<bool> valid_elements(const Mesh& mesh) {
  const Job job = test::smooth(
      mesh, {.max_iterations = 0, .element_quality_metrics = {QualityMetric::scaled_jacobian}});
  const auto values = job.summary.element_quality.of(0);
  std::vector<bool> valid;
  for (const float value : values) valid.push_back(value > 0);
  return valid;
}

TEST(Fit, InvertsNoElementThatWasValidWhereOthersStayInverted) {
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  for (const ElementType type : {ElementType::hexahedron, ElementType::tetrahedron}) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      const Mesh mesh = test::tangled_box_mesh(type, seed);
      const Job job = test::smooth(mesh, sliding(), on(surface));
      const std::vector<bool> before = valid_elements(mesh), after = valid_elements(job.mesh);
      ASSERT_GT(job.summary.quality_after.inverted_count, 0);
      for (std::size_t e = 0; e < before.size(); ++e) {
        EXPECT_TRUE(after[e] || !before[e]) << element_name(type) << ", " << seed << ", " << e;
      }
      EXPECT_EQ(job.summary.fit->reached_count + job.summary.fit->held_count,
                job.summary.fit->node_count);
    }
  }
}

TEST(Fit, RefusesMeshesOfCoordinatesWhoseSquaresOverflow) {
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  EXPECT_THROW(test::smooth(box_mesh(ElementType::hexahedron, 2, 0, 1e200), sliding(), on(surface)),
               InvalidMesh);
}

TEST(Fit, GivesTheSameBitsWithAnyNumberOfThreads) {
  const SurfaceMesh surface = test::sphere_surface(12, 1);
  const Mesh mesh = box_mesh(ElementType::hexahedron, 5, -0.6, 0.6);
  EXPECT_TRUE(test::same_bits(test::smooth(mesh, sliding(), on(surface), 1).mesh,
                              test::smooth(mesh, sliding(), on(surface), 4).mesh));
}

TEST(Fit, RefusesWhatItIsNotFor) {
  const SurfaceMesh surface = box_surface(3, {1, 1, 1});
  const auto refuses = [&](const Mesh& mesh, const SmoothOptions& options) {
    EXPECT_THROW(test::smooth(mesh, options, on(surface)), NotSupported);
  };
  const Mesh hexes = box_mesh(ElementType::hexahedron, 2, 0, 1);
  SmoothOptions options = sliding();
  options.boundary = BoundaryPolicy::fixed;
  refuses(hexes, options);
  options = sliding();
  options.method = Laplacian{};
  refuses(hexes, options);
  options = sliding();
  options.only_below = OnlyBelow{.quality = 0.5};
  refuses(hexes, options);
  refuses(test::lattice(ElementType::quad, 3), sliding());
  refuses(test::second_order(test::lattice(ElementType::tetrahedron, 2)), sliding());
}

TEST(Fit, TakesTheTrianglesOfASurfaceMesh) {
  const Mesh quads = test::lattice(ElementType::quad, 3);
  const SurfaceMesh surface = surface_of(quads);
  EXPECT_EQ(surface.triangles.size(), 18u);
  const Mesh curved = test::second_order(test::lattice(ElementType::triangle, 2));
  EXPECT_EQ(surface_of(curved).triangles.size(), 4 * curved.element_count());
  EXPECT_THROW(static_cast<void>(surface_of(test::lattice(ElementType::hexahedron, 2))),
               InvalidMesh);
}

}  // namespace
}  // namespace meshsmooth

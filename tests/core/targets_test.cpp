// What the elements of Optimize aim at: layers, references, anchors, bad elements only.

#include <gmock/gmock.h>

#include <limits>

#include "core/layers.hpp"
#include "core/promises.hpp"
#include "meshsmooth/error.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

using formats::LayerElements;
using test::first_height;
using test::Job;
using test::layer_cases;
using test::LayerCase;
using test::points;
using test::same_bits;

double least_jacobian(const Job& job) {
  return test::scaled_jacobian(job.summary.quality_after).min;
}

SmoothOptions aiming_at(Target target) { return {.method = Optimize{.target = target}}; }
JobInput at(const Mesh& reference) { return {.reference = reference.positions_view()}; }

Mesh layer(formats::LayerOptions options) { return formats::generate_layer(options).mesh; }

TEST(LayerTargets, LeaveAPerfectLayerBitForBit) {
  for (const LayerCase& c :
       layer_cases({LayerElements::hexahedra, LayerElements::wedges, LayerElements::quads})) {
    const Mesh mesh = c.mesh();
    EXPECT_TRUE(same_bits(test::smooth(mesh, {}).mesh, mesh)) << c.name();
    // Rounded to 32 bits, the thinnest layers are perfect no more.
    const Mesh rounded = test::as_float32(mesh);
    const std::vector<Vec3d> before = test::points_as_double(rounded);
    const std::vector<Vec3d> after = test::points_as_double(test::smooth(rounded, {}).mesh);
    for (std::size_t n = 0; n < before.size(); ++n) {
      ASSERT_LE(norm(after[n] - before[n]), 1e-6 * c.first) << n << " of " << c.name();
    }
  }
}

TEST(LayerTargets, StraightenAJitteredLayer) {
  const auto smoother = make_smoother("cpu", 2);
  for (const LayerCase& c : layer_cases({LayerElements::hexahedra})) {
    test::expect_straightened(*smoother, c);
  }
}

TEST(LayerTargets, KeepTheLayerOnATangledCore) {
  for (const LayerElements type : {LayerElements::hexahedra, LayerElements::wedges}) {
    formats::LayerOptions options{.elements = type, .core = 12};
    const Mesh clean = layer(options);
    options.tangle = 0.3;
    const Mesh tangled = layer(options);
    ASSERT_GT(measure_quality(tangled).inverted_count, 100);
    const Job job = test::smooth(tangled, {});
    EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
    EXPECT_NEAR(first_height(job.mesh, clean, 1e-3), 1e-3, 1e-5);
  }
}

TEST(IdealTargets, AreThoseOfElementsWithoutAMeantAspectRatio) {
  const auto smoother = make_smoother("cpu", 2);
  for (const auto& [name, mesh] : test::isotropic_hexahedra(8)) {
    test::expect_as_good_as_ideal(*smoother, name, mesh, 1e-12);
  }
}

TEST(Reference, BringsAJitteredLayerBack) {
  for (const LayerCase& c :
       layer_cases({LayerElements::hexahedra, LayerElements::wedges, LayerElements::tetrahedra})) {
    if (c.badly_tangled_by_jitter()) continue;
    SCOPED_TRACE(c.name());
    const Mesh clean = c.mesh();
    const Job job = test::smooth(c.mesh(0.3), {}, at(clean));
    EXPECT_NEAR(first_height(job.mesh, clean, c.first), c.first, 1e-3 * c.first);
    EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
    if (c.elements == LayerElements::hexahedra) {
      EXPECT_GE(least_jacobian(job), 0.99);
    }
  }
}

TEST(Reference, IsAFixedPoint) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 4), 0.14, 6);
    const Job input = test::smooth(mesh, aiming_at(Target::input));
    EXPECT_TRUE(same_bits(input.mesh, mesh)) << element_name(type);
    EXPECT_EQ(input.summary.flat_reference_element_count, 0);
    // In another precision, turned and scaled it is the same shape.
    const Mesh turned = test::as_float32(test::mapped(mesh, [](Vec3d p) {
      return Vec3d{-3 * p.y, 3 * p.x, 3 * p.z};
    }));
    const Job job = test::smooth(mesh, {}, at(turned));
    EXPECT_LT(test::difference(job.mesh, test::oracle::to_points(mesh)), 1e-6);
  }
}

TEST(Reference, TellsWhatSlidesWhere) {
  const auto hub = [](double degrees) {
    return test::with_fixed_set(
        formats::generate_hub({.rows = 12, .degrees = degrees, .layers = 12}));
  };
  const Mesh clean = hub(0);
  const Job job = test::smooth(hub(30), {.boundary = BoundaryPolicy::slide}, at(clean));
  EXPECT_GT(job.summary.quality_before.inverted_count, 1000);
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
  for (const Vec3d& p : points(job.mesh)) ASSERT_TRUE(p.z >= 0);
}

TEST(Reference, LetsFacetsOfAFarErrorTurnOver) {
  const auto hub = [](double degrees) {
    return test::with_fixed_set(
        formats::generate_hub({.rows = 30, .degrees = degrees, .layers = 4}));
  };
  const Mesh clean = hub(0);
  const Job job = test::smooth(hub(30), {.boundary = BoundaryPolicy::slide}, at(clean));
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
  EXPECT_EQ(job.summary.stop_reason, StopReason::converged);
}

TEST(Reference, WithFlatElementsLeavesThoseTheirIdealShape) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 6);
  Mesh reference = mesh;
  const std::size_t middle = mesh.node_count() / 2;
  points(reference)[middle] += Vec3d{10, 0, 0};
  const Job job = test::smooth(mesh, {}, at(reference));
  EXPECT_GT(job.summary.flat_reference_element_count, 0);
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
}

std::string thrown(const Mesh& mesh, const SmoothOptions& options, const JobInput& input = {}) {
  try {
    test::smooth(mesh, options, input);
  } catch (const Error& error) {
    return error.reason();
  }
  return "nothing";
}

TEST(Reference, IsRefusedByNameWhereItIsNone) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 3);
  const Mesh smaller = test::lattice(ElementType::hexahedron, 2);
  EXPECT_EQ(thrown(mesh, {}, at(smaller)), "ARRAY_SIZE_MISMATCH");
  EXPECT_EQ(thrown(mesh, aiming_at(Target::reference), {}), "ARRAY_SIZE_MISMATCH");

  Mesh reference = mesh;
  points(reference)[7].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(thrown(mesh, {}, at(reference)), "NON_FINITE_COORDINATE");
  for (Vec3d& p : points(reference)) p.y = 0;
  EXPECT_EQ(thrown(mesh, {}, at(reference)), "REFERENCE_FLAT");

  EXPECT_EQ(thrown(mesh, aiming_at(Target::input), at(mesh)), "OPTION_NOT_SUPPORTED");
  EXPECT_EQ(thrown(mesh, {.method = Laplacian{}}, at(mesh)), "OPTION_NOT_SUPPORTED");
  EXPECT_EQ(thrown(mesh, {.method = Move{}}, at(mesh)), "OPTION_NOT_SUPPORTED");
}

TEST(Anchors, HoldNodesTheMoreTheHeavierTheyAre) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 6), 0.2, 6);
  double farthest = std::numeric_limits<double>::infinity();
  for (const double stay : {0.0, 0.3, 3.0, 3000.0}) {
    const Job job = test::smooth(mesh, {.method = Optimize{.stay = stay}});
    const double way = test::difference(job.mesh, test::oracle::to_points(mesh));
    EXPECT_LT(way, farthest) << stay;
    EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
    farthest = way;
  }
  EXPECT_LT(farthest, 2e-3);
}

TEST(OnlyBelow, MovesTheNodesOfBadElementsAndSomeRingsAroundThem) {
  Mesh mesh = test::lattice(ElementType::hexahedron, 9);
  const std::size_t bad = 5 * 100 + 5 * 10 + 5;  // a node inside
  const Vec3d middle = points(mesh)[bad] += Vec3d{0.4, 0.3, 0.2};
  for (const int rings : {0, 1, 2}) {
    const Job job = test::smooth(mesh, {.only_below = OnlyBelow{.quality = 0.9, .rings = rings}});
    EXPECT_GT(least_jacobian(job), 0.9);
    EXPECT_GT(job.summary.nodes.outside_only_below, 0);
    for (std::size_t n = 0; n < mesh.node_count(); ++n) {
      const Vec3d way = points(mesh)[n] - middle;
      const double far = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)});
      if (far > 1.5 + rings) {
        ASSERT_EQ(points(job.mesh)[n], points(mesh)[n]) << n;
      }
    }
  }
  const Mesh good = test::lattice(ElementType::hexahedron, 4);
  const Job job = test::smooth(good, {.only_below = OnlyBelow{.quality = 0.9}});
  EXPECT_EQ(job.summary.nodes.fixed, job.summary.nodes.total);
  EXPECT_EQ(thrown(good, {.only_below = OnlyBelow{.quality = 1.5}}), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(thrown(good, {.only_below = OnlyBelow{.quality = 0.5, .rings = -1}}),
            "OPTION_OUT_OF_RANGE");
}

}  // namespace
}  // namespace meshsmooth

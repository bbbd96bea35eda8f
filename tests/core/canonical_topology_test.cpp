// Collapsed and interface elements: evaluated and smoothed as what they are.

#include "meshsmooth/canonical_topology.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/canonical_meshes.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Expand, KnowsTheUsualPatternsOfAHexahedron) {
  struct Pattern {
    std::vector<NodeId> nodes;
    ElementType type;
  };
  const std::vector<Pattern> patterns = {
      {{0, 1, 2, 2, 4, 5, 6, 6}, ElementType::wedge},        // an edge of both ends
      {{0, 1, 2, 3, 4, 5, 4, 5}, ElementType::hexahedron},   // not a type: see below
      {{0, 1, 2, 3, 4, 4, 4, 4}, ElementType::pyramid},      // a face
      {{0, 1, 2, 2, 4, 4, 4, 4}, ElementType::tetrahedron},  // a face and an edge
      {{0, 1, 2, 3, 0, 1, 6, 7}, ElementType::wedge},        // two edges of one face
  };
  for (const Pattern& pattern : patterns) {
    const auto found = detail::expand(ElementType::hexahedron, pattern.nodes);
    if (pattern.type == ElementType::hexahedron) {
      EXPECT_FALSE(found.has_value());
      continue;
    }
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->type, pattern.type);
    std::set<NodeId> own(pattern.nodes.begin(), pattern.nodes.end());
    const auto nodes = test::nodes_of(*found);
    EXPECT_EQ(std::set<NodeId>(nodes.begin(), nodes.end()), own);
  }
}

TEST(Expand, KnowsThoseOfOtherTypes) {
  EXPECT_EQ(test::nodes_of(*detail::expand(ElementType::quad, std::vector<NodeId>{5, 6, 7, 7})),
            (std::vector<NodeId>{5, 6, 7}));
  EXPECT_EQ(detail::expand(ElementType::wedge, std::vector<NodeId>{0, 1, 2, 3, 3, 3})->type,
            ElementType::tetrahedron);
  EXPECT_EQ(detail::expand(ElementType::wedge, std::vector<NodeId>{0, 1, 2, 3, 4, 2})->type,
            ElementType::pyramid);
  EXPECT_EQ(detail::expand(ElementType::pyramid, std::vector<NodeId>{0, 1, 2, 2, 4})->type,
            ElementType::tetrahedron);
}

TEST(Expand, RefusesWhatFormsNoType) {
  EXPECT_FALSE(detail::expand(ElementType::triangle, std::vector<NodeId>{0, 1, 1}));
  EXPECT_FALSE(detail::expand(ElementType::quad, std::vector<NodeId>{0, 1, 0, 2}));
  EXPECT_FALSE(detail::expand(ElementType::tetrahedron, std::vector<NodeId>{0, 1, 2, 2}));
  EXPECT_FALSE(
      detail::expand(ElementType::hexahedron, std::vector<NodeId>{0, 1, 2, 3, 4, 5, 6, 6}));
}

TEST(CollapsedElements, AreSmoothedAsWhatTheyAre) {
  const Mesh plain = test::split_cube(false), collapsed = test::split_cube(true);
  ASSERT_EQ(measure_quality(plain).inverted_count, 0);
  EXPECT_EQ(measure_quality(collapsed).collapsed_count, 32);
  EXPECT_EQ(measure_quality(collapsed).inverted_count, 0);
  for (const test::Way& way : test::ways(false)) {
    const SmoothOptions options{.method = way.method, .form = way.form, .max_iterations = 4};
    const test::Job expected = test::smooth(plain, options);
    const test::Job found = test::smooth(collapsed, options);
    EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh)) << way.name;
    EXPECT_EQ(found.summary.quality_after.collapsed_count, 32);
    EXPECT_EQ(found.mesh.blocks[0].nodes, collapsed.blocks[0].nodes);
  }
}

/// How a type is written as one of more corners: the nodes in its order.
struct Written {
  ElementType type, as;
  std::vector<std::size_t> order;
};

TEST(CollapsedElements, OfEveryTypeAreSmoothedAsWhatTheyAre) {
  using enum ElementType;
  const std::vector<Written> ways = {{triangle, quad, {0, 1, 2, 2}},
                                     {tetrahedron, pyramid, {0, 1, 2, 2, 3}},
                                     {tetrahedron, wedge, {0, 1, 2, 3, 3, 3}},
                                     {tetrahedron, hexahedron, {0, 1, 2, 2, 3, 3, 3, 3}},
                                     {pyramid, wedge, {4, 0, 1, 4, 3, 2}},
                                     {pyramid, hexahedron, {0, 1, 2, 3, 4, 4, 4, 4}},
                                     {wedge, hexahedron, {0, 1, 2, 2, 3, 4, 5, 5}}};
  for (const Written& way : ways) {
    Mesh plain = test::noisy(test::lattice(way.type, 4), 0.1, 5), collapsed = plain;
    const std::size_t width = element_width(way.type);
    ElementBlock written{way.as, {}}, meant{way.type, {}};
    const auto& nodes = plain.blocks[0].nodes;
    for (std::size_t first = 0; first < nodes.size(); first += width) {
      std::vector<NodeId> own;
      for (const std::size_t n : way.order) own.push_back(nodes[first + n]);
      written.nodes.insert(written.nodes.end(), own.begin(), own.end());
      const auto element = detail::expand(way.as, own);
      ASSERT_TRUE(element && element->type == way.type);
      meant.nodes.insert(meant.nodes.end(), element->list().begin(), element->list().end());
    }
    plain.blocks = {meant};
    collapsed.blocks = {written};
    const auto count = static_cast<std::int64_t>(plain.element_count());
    for (const Method& method : {Method(Optimize{}), Method(SmartLaplacian{})}) {
      const test::Job expected = test::smooth(plain, {.method = method, .max_iterations = 4});
      const test::Job found = test::smooth(collapsed, {.method = method, .max_iterations = 4});
      EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh)) << element_name(way.as);
      EXPECT_EQ(found.summary.quality_after.collapsed_count, count);
      EXPECT_EQ(found.summary.quality_after.inverted_count, 0);
      EXPECT_GT(found.summary.nodes.moved, 0);
    }
  }
}

TEST(CollapsedElements, KeepTheirTopologyPreparedForManyJobs) {
  const Mesh collapsed = test::split_cube(true);
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(collapsed);
  const auto prepared = smoother->prepare(topology.view());
  Mesh result = collapsed;
  const SmoothSummary summary = smoother->smooth(*prepared, result.positions_span(), {}, {});
  EXPECT_EQ(summary.quality_after.collapsed_count, 32);
  EXPECT_GT(summary.nodes.moved, 0);
}

TEST(CollapsedElements, AreRefusedByNameWhereTheyFormNoType) {
  Mesh mesh = test::split_cube(true);
  mesh.blocks[0].nodes[8 * 5 + 1] = mesh.blocks[0].nodes[8 * 5];
  try {
    test::smooth(mesh, {});
    FAIL();
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "REPEATED_NODE");
    EXPECT_THAT(error.what(), HasSubstr("element 5 "));
  }
}

TEST(ExtraMemory, IsAskedForWhereTheConnectivityIsHeldTwice) {
  const auto smoother = make_smoother("cpu", 1);
  for (const ElementType type : kElementTypes) {
    const Mesh plain = test::lattice_of(type, 4);
    Mesh half = plain;
    std::vector<std::uint8_t> mirrored(plain.element_count());
    for (std::size_t e = 0; e < mirrored.size(); e += 2) mirrored[e] = 1;
    mirror_elements(half.blocks, mirrored);
    std::int64_t extra = 0;
    JobControl control;
    control.on_extra_memory = [&](std::int64_t bytes) { extra += bytes; };

    Mesh mesh = plain;
    const std::int64_t peak = smoother->smooth(mesh, SmoothOptions{}, control).host_peak_bytes;
    EXPECT_EQ(extra, 0) << element_name(type);
    mesh = half;
    const std::int64_t twice = smoother->smooth(mesh, SmoothOptions{}, control).host_peak_bytes;
    EXPECT_EQ(twice, peak + extra) << element_name(type);
    EXPECT_GE(extra, static_cast<std::int64_t>(plain.blocks[0].nodes.size() * sizeof(NodeId)));

    mesh = half;
    control.on_extra_memory = [](std::int64_t) { throw OutOfMemory("MESH_TOO_LARGE", "full"); };
    EXPECT_THROW(smoother->smooth(mesh, SmoothOptions{}, control), OutOfMemory);
    EXPECT_TRUE(test::same_bits(mesh, half)) << element_name(type);
  }
}

TEST(Canonical, JobsStartAnewOnlyWhereElementsMayBeMirrored) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron,
                                 ElementType::wedge, ElementType::pyramid}) {
    const Mesh plain = test::noisy(test::lattice(type, 8), 0.1, 3);
    const Mesh tangled = test::noisy(test::lattice(type, 8), 0.5, 3);
    ASSERT_GT(measure_quality(tangled).inverted_count, 20) << element_name(type);
    EXPECT_EQ(test::count_starts(plain), 1) << element_name(type);
    EXPECT_EQ(test::count_starts(tangled), 1) << element_name(type);

    std::vector<std::uint8_t> mirrored(plain.element_count());
    for (std::size_t e = 0; e < mirrored.size(); ++e) mirrored[e] = e == 77 ? 1 : 0;
    Mesh one = plain, all = plain, all_tangled = tangled;
    mirror_elements(one.blocks, mirrored);
    mirrored.assign(mirrored.size(), 1);
    mirror_elements(all.blocks, mirrored);
    mirror_elements(all_tangled.blocks, mirrored);
    EXPECT_EQ(test::count_starts(one), 2) << element_name(type);
    EXPECT_EQ(test::count_starts(all), 2) << element_name(type);
    EXPECT_EQ(test::count_starts(all_tangled), 2) << element_name(type);
  }
}

TEST(Canonical, BadlyTangledMeshesDoNotStartAnew) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron,
                                 ElementType::wedge, ElementType::pyramid}) {
    Mesh mesh = test::badly_tangled(type, 20);
    const QualityStats quality = measure_quality(mesh);
    ASSERT_GT(quality.inverted_count, 0.3 * static_cast<double>(quality.element_count))
        << element_name(type);
    EXPECT_EQ(test::count_starts(mesh), 1) << element_name(type);
    mirror_elements(mesh.blocks, std::vector<std::uint8_t>(mesh.element_count(), 1));
    EXPECT_EQ(test::count_starts(mesh), 2) << element_name(type);
  }
}

class Interfaces : public ::testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, Interfaces, ::testing::ValuesIn(kLinearTypes),
                         [](const auto& of) { return std::string(element_name(of.param)); });

void expect_matched(const test::Cut& cut, const test::Job& job, std::string_view way = "") {
  const std::vector<Vec3d>& points = test::points(job.mesh);
  for (const auto& [a, b] : cut.pairs) {
    EXPECT_EQ(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)]) << way;
  }
}

TEST_P(Interfaces, StayTogetherAndAreInNoFigure) {
  const test::Cut cut = test::cut_lattice(GetParam(), false);
  const auto regular = static_cast<std::int64_t>(cut.mesh.element_count()) - cut.interface_count;
  const QualityStats stats = measure_quality(cut.mesh);
  EXPECT_EQ(stats.interface_count, cut.interface_count);
  EXPECT_EQ(stats.element_count, regular);
  EXPECT_EQ(stats.inverted_count + stats.degenerate_count, 0);
  for (const test::Way& way : test::ways(false)) {
    for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::free}) {
      if (boundary == BoundaryPolicy::free && std::holds_alternative<Optimize>(way.method))
        continue;
      const test::Job job = test::smooth(cut.mesh, {.method = way.method,
                                                    .form = way.form,
                                                    .max_iterations = 5,
                                                    .boundary = boundary,
                                                    .never_worse = false});
      expect_matched(cut, job, way.name);
      EXPECT_EQ(job.summary.quality_after.interface_count, cut.interface_count);
      EXPECT_EQ(job.summary.quality_after.element_count, regular);
      EXPECT_GT(job.summary.nodes.moved, 0);
      // The interfaces come first in the mesh.
      for (const ElementQuality& worst : job.summary.quality_after.worst) {
        EXPECT_GE(worst.element, cut.interface_count);
      }
    }
  }
}

/// Nodes at one position are at one position again, also those in the middle of edges and faces.
void expect_together(const Mesh& before, const Mesh& after, std::string_view way) {
  const auto& first = std::get<std::vector<Vec3d>>(before.positions);
  const auto& last = std::get<std::vector<Vec3d>>(after.positions);
  std::map<std::array<double, 3>, Vec3d> found;
  std::size_t shared = 0;
  for (std::size_t n = 0; n < first.size(); ++n) {
    const std::array key = {first[n].x, first[n].y, first[n].z};
    const auto [at, is_new] = found.try_emplace(key, last[n]);
    shared += is_new ? 0 : 1;
    EXPECT_EQ(at->second, last[n]) << way << ", node " << n;
  }
  EXPECT_GT(shared, 0U);
}

TEST_P(Interfaces, OfSecondOrderToo) {
  const test::Cut cut = test::cut_lattice(GetParam(), true);
  for (const Method& method : {Method{Optimize{}}, Method{SmartLaplacian{}}, Method{Taubin{}}}) {
    for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
      const test::Job job =
          test::smooth(cut.mesh, {.method = method, .max_iterations = 5, .boundary = boundary});
      expect_together(cut.mesh, job.mesh, method_name(method));
      EXPECT_EQ(job.summary.quality_after.interface_count, cut.interface_count);
      EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
    }
  }
}

TEST_P(Interfaces, CracksOfSecondOrderStayClosed) {
  test::Cut cut = test::cut_lattice(GetParam(), true);
  cut.mesh.blocks.erase(cut.mesh.blocks.begin());
  for (const Method& method : {Method{Optimize{}}, Method{SmartLaplacian{}}, Method{Taubin{}}}) {
    const test::Job job = test::smooth(
        cut.mesh, {.method = method, .max_iterations = 5, .boundary = BoundaryPolicy::slide});
    expect_together(cut.mesh, job.mesh, method_name(method));
    EXPECT_GT(job.summary.nodes.moved, 0);
  }
}

TEST_P(Interfaces, HaveNoQualityOfTheirOwn) {
  const test::Cut cut = test::cut_lattice(GetParam(), false);
  const test::Job job =
      test::smooth(cut.mesh, {.element_quality_metrics = {QualityMetric::mean_ratio}});
  const auto values = job.summary.element_quality.of(0);
  ASSERT_EQ(values.size(), cut.mesh.element_count());
  for (std::size_t e = 0; e < values.size(); ++e) {
    EXPECT_EQ(std::isnan(values[e]), e < static_cast<std::size_t>(cut.interface_count)) << e;
  }
}

TEST_P(Interfaces, TakePartInAMotion) {
  const test::Cut cut = test::cut_lattice(GetParam(), false);
  const auto& points = std::get<std::vector<Vec3d>>(cut.mesh.positions);
  const auto corner = static_cast<NodeId>(0);
  const std::vector<NodeId> nodes = {corner};
  const std::vector<Vec3d> to = {points[0] + Vec3d{0.01, 0.01, 0}};
  const test::Job job = test::smooth(cut.mesh, {.method = Move{}},
                                     {.prescribed = {nodes, std::span<const Vec3d>(to)}});
  EXPECT_EQ(job.summary.motion->reached, 1);
  EXPECT_EQ(job.summary.quality_after.interface_count, cut.interface_count);
}

/// The two sides of a crack, which share positions but not nodes.
TEST_P(Interfaces, OrWithoutElementsStayTogetherUnderEveryBoundary) {
  test::Cut cut = test::cut_lattice(GetParam(), false);
  cut.mesh.blocks.erase(cut.mesh.blocks.begin());
  for (const test::Way& way : test::ways(false)) {
    for (const BoundaryPolicy boundary : {BoundaryPolicy::slide, BoundaryPolicy::free}) {
      if (boundary == BoundaryPolicy::free && std::holds_alternative<Optimize>(way.method))
        continue;
      const test::Job job = test::smooth(cut.mesh, {.method = way.method,
                                                    .form = way.form,
                                                    .max_iterations = 5,
                                                    .boundary = boundary,
                                                    .never_worse = false});
      expect_matched(cut, job, way.name);
      EXPECT_EQ(job.summary.nodes.coincident, static_cast<std::int64_t>(2 * cut.pairs.size()));
      EXPECT_GT(job.summary.nodes.moved, 0);
    }
  }
  EXPECT_EQ(test::smooth(cut.mesh, {}).summary.nodes.coincident, 0);  // the boundary stays anyway
}

}  // namespace
}  // namespace meshsmooth

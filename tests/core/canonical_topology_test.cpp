// Collapsed and interface elements: evaluated and smoothed as what they are.

#include "meshsmooth/canonical_topology.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/smoothing.hpp"
#include "mesh/canonical/collapsed_element.hpp"
#include "meshsmooth/error.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<NodeId> nodes_of(const detail::PlainElement& element) {
  return {element.list().begin(), element.list().end()};
}

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
    const auto nodes = nodes_of(*found);
    EXPECT_EQ(std::set<NodeId>(nodes.begin(), nodes.end()), own);
  }
}

TEST(Expand, KnowsThoseOfOtherTypes) {
  EXPECT_EQ(nodes_of(*detail::expand(ElementType::quad, std::vector<NodeId>{5, 6, 7, 7})),
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

/// A cube of hexahedra in which each of the first layer is split along a diagonal into two wedges,
/// written as hexahedra that repeat an edge if `collapsed`.
Mesh split_cube(bool collapsed) {
  const Mesh cube = test::noisy(test::lattice(ElementType::hexahedron, 4), 0.1, 5);
  Mesh mesh{cube.positions, {}, cube.fixed};
  const auto add = [&](ElementType type, std::vector<NodeId> nodes) {
    if (mesh.blocks.empty() || mesh.blocks.back().type != type) mesh.blocks.push_back({type, {}});
    auto& all = mesh.blocks.back().nodes;
    all.insert(all.end(), nodes.begin(), nodes.end());
  };
  const auto& from = cube.blocks[0].nodes;
  for (std::size_t e = 0; e < from.size() / 8; ++e) {
    const NodeId* n = &from[8 * e];
    if (e >= 16) {
      add(ElementType::hexahedron, {n, n + 8});
    } else if (collapsed) {
      add(ElementType::hexahedron, {n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]});
      add(ElementType::hexahedron, {n[0], n[2], n[3], n[3], n[4], n[6], n[7], n[7]});
    } else {
      add(ElementType::wedge,
          nodes_of(*detail::expand(
              ElementType::hexahedron,
              std::vector<NodeId>{n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]})));
      add(ElementType::wedge,
          nodes_of(*detail::expand(
              ElementType::hexahedron,
              std::vector<NodeId>{n[0], n[2], n[3], n[3], n[4], n[6], n[7], n[7]})));
    }
  }
  return mesh;
}

TEST(CollapsedElements, AreSmoothedAsWhatTheyAre) {
  const Mesh plain = split_cube(false), collapsed = split_cube(true);
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

TEST(CollapsedElements, KeepTheirTopologyPreparedForManyJobs) {
  const Mesh collapsed = split_cube(true);
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(collapsed);
  const auto prepared = smoother->prepare(topology.view());
  Mesh result = collapsed;
  const SmoothSummary summary = smoother->smooth(*prepared, result.positions_span(), {}, {});
  EXPECT_EQ(summary.quality_after.collapsed_count, 32);
  EXPECT_GT(summary.nodes.moved, 0);
}

TEST(CollapsedElements, AreRefusedByNameWhereTheyFormNoType) {
  Mesh mesh = split_cube(true);
  mesh.blocks[0].nodes[8 * 5 + 1] = mesh.blocks[0].nodes[8 * 5];
  try {
    test::smooth(mesh, {});
    FAIL();
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "REPEATED_NODE");
    EXPECT_THAT(error.what(), HasSubstr("element 5 "));
  }
}

/// A lattice cut in the middle: the nodes there are doubled, and elements without thickness of
/// `type` lie between.
struct Cut {
  Mesh mesh;
  std::vector<std::pair<NodeId, NodeId>> pairs;
  std::int64_t interface_count = 0;
};

Cut cut_lattice(ElementType volume, bool second_order) {
  Cut cut{test::noisy(test::lattice(volume, 4), 0.12, 7), {}, 0};
  Mesh& mesh = cut.mesh;
  auto& points = test::points(mesh);
  const int axis = element_shape(volume).dimension - 1;
  const auto along = [axis](Vec3d p) { return axis == 1 ? p.y : p.z; };
  const Mesh even = test::lattice(volume, 4);
  const std::vector<Vec3d> grid = std::get<std::vector<Vec3d>>(even.positions);
  double low = along(grid[0]), high = low;
  for (const Vec3d p : grid) low = std::min(low, along(p)), high = std::max(high, along(p));
  const double middle = (low + high) / 2;
  std::map<NodeId, NodeId> other;
  for (std::size_t n = 0; n < grid.size(); ++n) {
    if (std::abs(along(grid[n]) - middle) > 1e-9) continue;
    other[static_cast<NodeId>(n)] = static_cast<NodeId>(points.size());
    cut.pairs.emplace_back(static_cast<NodeId>(n), static_cast<NodeId>(points.size()));
    points.push_back(Vec3d(points[n]));
  }
  if (!mesh.fixed.empty()) mesh.fixed.resize(points.size());
  const ElementShape& shape = element_shape(volume);
  const auto width = static_cast<std::size_t>(shape.node_count);
  ElementBlock interfaces{axis == 1                           ? ElementType::quad
                          : volume == ElementType::hexahedron ? ElementType::hexahedron
                                                              : ElementType::wedge,
                          {}};
  auto& nodes = mesh.blocks[0].nodes;
  for (std::size_t e = 0; e < nodes.size() / width; ++e) {
    NodeId* const own = &nodes[e * width];
    double centre = 0;
    for (std::size_t n = 0; n < width; ++n) centre += along(grid[static_cast<std::size_t>(own[n])]);
    if (centre / static_cast<double>(width) < middle) continue;
    for (int f = 0; f < shape.facet_count; ++f) {
      const FacetShape& facet = shape.facets[f];
      std::vector<NodeId> face;
      for (int n = 0; n < facet.node_count; ++n) face.push_back(own[facet.nodes[n]]);
      if (!std::ranges::all_of(face, [&](NodeId n) { return other.contains(n); })) continue;
      ++cut.interface_count;
      if (axis == 1) {
        for (const NodeId n : {face[0], face[1], other[face[1]], other[face[0]]})
          interfaces.nodes.push_back(n);
      } else {
        for (const NodeId n : face) interfaces.nodes.push_back(n);
        for (const NodeId n : face) interfaces.nodes.push_back(other[n]);
      }
    }
    for (std::size_t n = 0; n < width; ++n) {
      if (other.contains(own[n])) own[n] = other[own[n]];
    }
  }
  mesh.blocks.insert(mesh.blocks.begin(), std::move(interfaces));
  if (second_order) mesh = test::second_order(mesh);
  return cut;
}

class Interfaces : public ::testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, Interfaces,
                         ::testing::Values(ElementType::triangle, ElementType::quad,
                                           ElementType::tetrahedron, ElementType::hexahedron),
                         [](const auto& of) { return std::string(element_name(of.param)); });

TEST_P(Interfaces, StayTogetherAndAreInNoFigure) {
  const Cut cut = cut_lattice(GetParam(), false);
  const auto regular = static_cast<std::int64_t>(cut.mesh.element_count()) - cut.interface_count;
  const QualityStats stats = measure_quality(cut.mesh);
  EXPECT_EQ(stats.interface_count, cut.interface_count);
  EXPECT_EQ(stats.element_count, regular);
  EXPECT_EQ(stats.inverted_count + stats.degenerate_count, 0);
  for (const test::Way& way : test::ways(false)) {
    for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::free}) {
      if (boundary == BoundaryPolicy::free && std::holds_alternative<Optimize>(way.method))
        continue;
      const test::Job job = test::smooth(
          cut.mesh,
          {.method = way.method, .form = way.form, .max_iterations = 5, .boundary = boundary});
      const auto& points = std::get<std::vector<Vec3d>>(job.mesh.positions);
      for (const auto& [a, b] : cut.pairs) {
        EXPECT_EQ(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)])
            << way.name;
      }
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

TEST_P(Interfaces, OfSecondOrderToo) {
  const Cut cut = cut_lattice(GetParam(), true);
  const test::Job job = test::smooth(cut.mesh, {});
  const auto& points = std::get<std::vector<Vec3d>>(job.mesh.positions);
  for (const auto& [a, b] : cut.pairs) {
    EXPECT_EQ(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)]);
  }
  EXPECT_EQ(job.summary.quality_after.interface_count, cut.interface_count);
  EXPECT_EQ(job.summary.quality_after.inverted_count, 0);
}

TEST_P(Interfaces, HaveNoQualityOfTheirOwn) {
  const Cut cut = cut_lattice(GetParam(), false);
  const test::Job job =
      test::smooth(cut.mesh, {.element_quality_metrics = {QualityMetric::mean_ratio}});
  const auto values = job.summary.element_quality.of(0);
  ASSERT_EQ(values.size(), cut.mesh.element_count());
  for (std::size_t e = 0; e < values.size(); ++e) {
    EXPECT_EQ(std::isnan(values[e]), e < static_cast<std::size_t>(cut.interface_count)) << e;
  }
}

TEST_P(Interfaces, TakePartInAMotion) {
  const Cut cut = cut_lattice(GetParam(), false);
  const auto& points = std::get<std::vector<Vec3d>>(cut.mesh.positions);
  const auto corner = static_cast<NodeId>(0);
  const std::vector<NodeId> nodes = {corner};
  const std::vector<Vec3d> to = {points[0] + Vec3d{0.01, 0.01, 0}};
  const test::Job job =
      test::smooth(cut.mesh, {.method = Move{}, .prescribed = {nodes, std::span<const Vec3d>(to)}});
  EXPECT_EQ(job.summary.motion->reached, 1);
  EXPECT_EQ(job.summary.quality_after.interface_count, cut.interface_count);
}

/// The two sides of a crack, which share positions but not nodes.
TEST_P(Interfaces, OrWithoutElementsStayTogetherUnderEveryBoundary) {
  Cut cut = cut_lattice(GetParam(), false);
  cut.mesh.blocks.erase(cut.mesh.blocks.begin());
  for (const test::Way& way : test::ways(false)) {
    for (const BoundaryPolicy boundary : {BoundaryPolicy::slide, BoundaryPolicy::free}) {
      if (boundary == BoundaryPolicy::free && std::holds_alternative<Optimize>(way.method))
        continue;
      const test::Job job = test::smooth(
          cut.mesh,
          {.method = way.method, .form = way.form, .max_iterations = 5, .boundary = boundary});
      const auto& points = std::get<std::vector<Vec3d>>(job.mesh.positions);
      for (const auto& [a, b] : cut.pairs) {
        EXPECT_EQ(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)])
            << way.name;
      }
      EXPECT_EQ(job.summary.nodes.coincident, static_cast<std::int64_t>(2 * cut.pairs.size()));
      EXPECT_GT(job.summary.nodes.moved, 0);
    }
  }
  EXPECT_EQ(test::smooth(cut.mesh, {}).summary.nodes.coincident, 0);  // the boundary stays anyway
}

}  // namespace
}  // namespace meshsmooth

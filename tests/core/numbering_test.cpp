// Elements that are numbered the other way round: in the connectivity, not tangled.

#include "meshsmooth/numbering.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "core/canonical_meshes.hpp"
#include "meshsmooth/error.hpp"
#include "support/surfaces.hpp"

namespace meshsmooth {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Numbering numbering_of(const Mesh& mesh) {
  const MeshTopology topology(mesh);
  return find_numbering(topology.view(), mesh.positions_view());
}

TEST(FindNumbering, FindsNothingInMeshesNumberedAlike) {
  for (const ElementType type : test::all_types()) {
    const Numbering found = numbering_of(test::lattice_of(type, 3));
    EXPECT_EQ(found.mirrored_count, 0) << element_name(type);
    EXPECT_THAT(found.mirrored, IsEmpty());
    EXPECT_EQ(found.cut_facet_count, 0);
  }
  EXPECT_EQ(numbering_of(test::mixed_stack(3)).mirrored_count, 0);
}

TEST(FindNumbering, FindsTheMirroredElementsOfEveryType) {
  for (const ElementType type : test::all_types()) {
    Mesh mesh = test::lattice_of(type, 3);
    std::vector<std::uint8_t> mirrored(mesh.element_count());
    for (const std::size_t e : {1U, 2U, 7U}) mirrored[e] = 1;
    mirror_elements(mesh.blocks, mirrored);

    EXPECT_EQ(numbering_of(mesh).mirrored, mirrored) << element_name(type);
    EXPECT_EQ(numbering_of(mesh).mirrored_count, 3);
  }
}

TEST(FindNumbering, EndsWhenItsCallerSaysSo) {
  const Mesh mesh = test::lattice(ElementType::tetrahedron, 30);
  const MeshTopology topology(mesh);
  int count = 0;
  (void)find_numbering(topology.view(), mesh.positions_view(), [&] { ++count; });
  ASSERT_GE(count, 3);
  for (int last = 1; last <= count; ++last) {
    int calls = 0;
    const auto check = [&] {
      if (++calls == last) throw Cancelled("CANCELLED", "the job was cancelled");
    };
    EXPECT_THROW((void)find_numbering(topology.view(), mesh.positions_view(), check), Cancelled);
    EXPECT_EQ(calls, last);
  }
}

TEST(FindNumbering, TurnsAWhollyMirroredVolumeMeshAndEachComponentByItself) {
  for (const ElementType type : test::all_types()) {
    if (element_shape(type).dimension == 2) continue;
    Mesh mesh = test::lattice_of(type, 3);
    mirror_elements(mesh.blocks, std::vector<std::uint8_t>(mesh.element_count(), 1));
    EXPECT_EQ(numbering_of(mesh).mirrored_count, static_cast<std::int64_t>(mesh.element_count()));
  }
  Mesh apart = test::tet_ball();
  const std::size_t count = apart.element_count();
  const auto nodes = static_cast<NodeId>(apart.node_count());
  const std::vector<Vec3d> points = test::points(apart);
  for (Vec3d p : points) test::points(apart).push_back({p.x + 100, p.y, p.z});
  const std::vector<NodeId> first = apart.blocks[0].nodes;
  for (const NodeId node : first) apart.blocks[0].nodes.push_back(node + nodes);
  std::vector<std::uint8_t> second(2 * count);
  std::fill(second.begin() + static_cast<std::ptrdiff_t>(count), second.end(), 1);
  mirror_elements(apart.blocks, second);

  EXPECT_EQ(numbering_of(apart).mirrored, second);
}

TEST(FindNumbering, LeavesASurfaceThatIsNumberedAlikeOnItsSide) {
  for (Mesh mesh : {test::lattice(ElementType::quad, 3), test::sphere(2)}) {
    mirror_elements(mesh.blocks, std::vector<std::uint8_t>(mesh.element_count(), 1));
    EXPECT_EQ(numbering_of(mesh).mirrored_count, 0);
  }
}

/// A band that comes round with its sides exchanged, of `sides` by `rows` cells; its inner nodes
/// are off the grid by up to `jitter` of a cell.
Mesh moebius_strip(ElementType type, int sides, int rows, double jitter = 0) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> off(-jitter, jitter);
  std::vector<Vec3d> points;
  std::vector<NodeId> nodes;
  const auto at = [&](int section, int row) {
    const bool round = section == sides;
    return static_cast<NodeId>((rows + 1) * (section % sides) + (round ? rows - row : row));
  };
  for (int s = 0; s < sides; ++s) {
    for (int row = 0; row <= rows; ++row) {
      const bool inside = row > 0 && row < rows;
      const double turn = 2 * std::numbers::pi * (s + (inside ? off(random) : 0)) / sides;
      const double side = 0.6 * (row + (inside ? off(random) : 0)) / rows - 0.3;
      const double radius = 1 + side * std::cos(turn / 2);
      points.push_back(
          {radius * std::cos(turn), radius * std::sin(turn), side * std::sin(turn / 2)});
    }
    for (int row = 0; row < rows; ++row) {
      const NodeId a = at(s, row), b = at(s + 1, row), c = at(s + 1, row + 1), d = at(s, row + 1);
      if (type == ElementType::quad) {
        nodes.insert(nodes.end(), {a, b, c, d});
      } else {
        nodes.insert(nodes.end(), {a, b, c, a, c, d});
      }
    }
  }
  return test::make_mesh(std::move(points), {{type, std::move(nodes)}});
}

TEST(FindNumbering, CutsAMoebiusStripAndSaysSo) {
  EXPECT_EQ(numbering_of(moebius_strip(ElementType::quad, 12, 1)).cut_facet_count, 1);
}

/// What is curved smoothly is no crease, also where numbering is cut.
TEST(MoebiusStrip, IsSmoothedAcrossItsCutAsElsewhere) {
  constexpr int kSides = 40, kRows = 6;
  for (const ElementType type : {ElementType::quad, ElementType::triangle}) {
    const Mesh strip = moebius_strip(type, kSides, kRows, 0.25);
    ASSERT_EQ(numbering_of(strip).cut_facet_count, kRows);
    for (const bool mixed : {false, true}) {
      Mesh mesh = strip;
      std::vector<std::uint8_t> some(mesh.element_count());
      for (std::size_t e = 0; e < some.size(); e += 3) some[e] = 1;
      if (mixed) mirror_elements(mesh.blocks, some);
      const test::Job job = test::smooth(mesh, {.method = Optimize{}});
      const NodeCounts& nodes = job.summary.nodes;
      EXPECT_EQ(nodes.sliding_in_plane + nodes.sliding_on_surface, kSides * (kRows - 1))
          << element_name(type) << mixed;
      EXPECT_EQ(nodes.sliding_on_line + nodes.sliding_on_curve + nodes.curved, 0);
      EXPECT_GT(nodes.moved, kSides * (kRows - 1) * 9 / 10);
      EXPECT_LE(job.summary.deviation.result_to_input, job.summary.deviation.tolerance);
      const auto least = [](const QualityStats& stats) {
        return std::ranges::find(stats.metrics, QualityMetric::mean_ratio, &MetricStats::metric)
            ->min;
      };
      EXPECT_GT(least(job.summary.quality_after), least(job.summary.quality_before));
    }
  }
}

TEST(FindNumbering, TellsATangledMeshFromAMirroredOne) {
  Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.5, 2);
  ASSERT_GT(measure_quality(mesh).inverted_count, 0);

  EXPECT_EQ(numbering_of(mesh).mirrored_count, 0);

  std::vector<std::uint8_t> some(mesh.element_count());
  for (std::size_t e = 0; e < some.size(); e += 3) some[e] = 1;
  const std::int64_t inverted = measure_quality(mesh).inverted_count;
  mirror_elements(mesh.blocks, some);
  EXPECT_EQ(numbering_of(mesh).mirrored, some);
  EXPECT_EQ(measure_quality(mesh).inverted_count, inverted);
}

TEST(FindNumbering, ListsTheFirstIds) {
  Mesh mesh = test::lattice_of(ElementType::hexahedron, 3);
  std::vector<std::uint8_t> mirrored(mesh.element_count());
  mirrored[4] = mirrored[9] = 1;
  mirror_elements(mesh.blocks, mirrored);

  const QualityStats stats = measure_quality(mesh);

  EXPECT_EQ(stats.mirrored_count, 2);
  EXPECT_THAT(stats.mirrored, ElementsAre(4, 9));
  EXPECT_EQ(stats.inverted_count, 0);
}

TEST(MirrorNodes, IsItsOwnInverseAndChangesTheSign) {
  for (const ElementType type : test::all_types()) {
    const Mesh mesh = test::lattice_of(type, 1);
    std::vector<NodeId> nodes(
        mesh.blocks[0].nodes.begin(),
        mesh.blocks[0].nodes.begin() + static_cast<std::ptrdiff_t>(element_width(type)));
    const std::vector<NodeId> before = nodes;
    mirror_nodes(type, nodes);
    EXPECT_NE(nodes, before);
    mirror_nodes(type, nodes);
    EXPECT_EQ(nodes, before) << element_name(type);
  }
}

/// Random meshes (MESHSMOOTH_MIRRORED_MESHES, 120 by default) of every element type, plane, curved
/// and volume, random elements of them mirrored.
TEST(MirroredMeshes, HaveTheBitsOfTheMeshNumberedAlike) {
  const char* const wish = std::getenv("MESHSMOOTH_MIRRORED_MESHES");
  const int count = wish == nullptr ? 120 : std::atoi(wish);
  const std::vector<test::Way> ways = test::ways(false);
  int mirrored_meshes = 0;
  for (int seed = 0; seed < count; ++seed) {
    std::mt19937_64 random(static_cast<unsigned>(seed));
    const auto types = test::all_types();
    const ElementType type = types[static_cast<std::size_t>(seed) % types.size()];
    const bool surface = element_shape(type).dimension == 2;
    Mesh mesh = surface && seed % 2 == 0 && !is_second_order(type)
                    ? test::wavy_if_surface(test::lattice_of(type, 4))
                    : test::lattice_of(type, 3);
    const test::Way& way = ways[random() % ways.size()];
    const SmoothOptions options{
        .method = way.method,
        .form = way.form,
        .max_iterations = 4,
        .boundary = seed % 3 == 0 ? BoundaryPolicy::slide : BoundaryPolicy::fixed};
    Mesh other = mesh;
    const auto chosen = test::some_elements(mesh, random);
    mirror_elements(other.blocks, chosen);
    const bool all = std::ranges::all_of(chosen, [](auto c) { return c != 0; });
    if (all && surface) continue;  // is numbered alike itself

    const test::Job expected = test::smooth(mesh, options);
    const test::Job found = test::smooth(other, options);

    EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh))
        << seed << " " << element_name(type) << " " << way.name;
    EXPECT_EQ(found.summary.quality_before.inverted_count, 0);
    // Averaging on a curved surface does not depend on the numbering, so nobody looks.
    if (surface && !std::holds_alternative<Optimize>(way.method)) continue;
    const auto mirrored = std::ranges::count(chosen, 1);
    EXPECT_EQ(found.summary.quality_before.mirrored_count, mirrored) << seed;
    mirrored_meshes += mirrored > 0 ? 1 : 0;
  }
  EXPECT_GT(mirrored_meshes, count / 3);
}

/// A square of twelve triangles, the four of one patch numbered clockwise.
TEST(MirroredMeshes, KeepTheirArea) {
  const Mesh mesh = test::make_mesh(
      {{0, 0, 0},
       {1, 0, 0},
       {2, 0, 0},
       {0, 1, 0},
       {1, 1, 0},
       {2, 1, 0},
       {0, 2, 0},
       {1, 2, 0},
       {2, 2, 0},
       {0.4, 0.6, 0},
       {1.45, 0.55, 0}},
      {{ElementType::triangle, {0,  1, 9, 1,  4, 9, 4, 3, 9, 3, 0, 9, 10, 2, 1, 10, 5, 2,
                                10, 4, 5, 10, 1, 4, 3, 4, 6, 4, 7, 6, 4,  5, 7, 5,  8, 7}}});
  for (const test::Way& way : test::ways(false)) {
    const test::Job job = test::smooth(mesh, {.method = way.method, .form = way.form});
    const std::vector<Vec3d>& at = test::points(job.mesh);
    double area = 0;  // folds would count twice
    for (std::size_t n = 0; n < 36; n += 3) {
      const auto corner = [&](std::size_t k) {
        return at[static_cast<std::size_t>(mesh.blocks[0].nodes[n + k])];
      };
      area += std::abs(cross(corner(1) - corner(0), corner(2) - corner(0)).z) / 2;
    }
    EXPECT_NEAR(area, 4, 1e-14) << way.name;
    EXPECT_EQ(job.summary.quality_before.mirrored_count, 4) << way.name;
    EXPECT_EQ(job.summary.quality_before.inverted_count, 0);
    EXPECT_GT(job.summary.nodes.moved, 0);
  }
}

/// What guards the elements of a curved surface measures them in the order of their nodes. An open
/// surface that is numbered alike keeps its side, which may not be that of the repaired one: there
/// the results agree to rounding.
TEST(MirroredMeshes, OfClosedSurfacesAreGuardedLikeThoseNumberedAlike) {
  std::mt19937_64 random(3);
  for (const Mesh& mesh : {test::jittered_sphere(), test::torus(ElementType::quad)}) {
    for (const Weighting weighting : {Weighting::uniform, Weighting::ball_volume}) {
      const SmoothOptions options{.method = SmartLaplacian{weighting}};
      Mesh other = mesh;
      std::vector<std::uint8_t> some(mesh.element_count());
      for (auto& one : some) one = random() % 2 == 0 ? 1 : 0;
      mirror_elements(other.blocks, some);
      const Mesh expected = test::smooth(mesh, options).mesh;
      EXPECT_TRUE(test::same_bits(expected, test::smooth(other, options).mesh));
    }
  }
}

TEST(MirroredMeshes, MoveAndUntangleLikeTheMeshNumberedAlike) {
  Mesh tangled = test::noisy(test::lattice(ElementType::tetrahedron, 5), 0.5, 2);
  Mesh other = tangled;
  std::vector<std::uint8_t> some(tangled.element_count());
  for (std::size_t e = 0; e < some.size(); e += 2) some[e] = 1;
  mirror_elements(other.blocks, some);

  const test::Job expected = test::smooth(tangled, {});
  const test::Job found = test::smooth(other, {});

  EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh));
  EXPECT_EQ(expected.summary.quality_before.inverted_count,
            found.summary.quality_before.inverted_count);
  EXPECT_EQ(found.summary.quality_after.mirrored_count, std::ranges::count(some, 1));
}

TEST(MirroredMeshes, KeepTheirTopologyPreparedForManyJobs) {
  const Mesh mesh = test::lattice_of(ElementType::tetrahedron, 4);
  Mesh other = mesh;
  std::vector<std::uint8_t> some(mesh.element_count());
  for (std::size_t e = 0; e < some.size(); e += 5) some[e] = 1;
  mirror_elements(other.blocks, some);
  const auto smoother = make_smoother("cpu", 2);
  const MeshTopology topology(other);
  const auto prepared = smoother->prepare(topology.view());
  const Mesh expected = test::smooth(mesh, {}).mesh;

  for (int job = 0; job < 3; ++job) {
    Mesh result = other;
    const SmoothSummary summary = smoother->smooth(*prepared, result.positions_span(), {}, {});
    EXPECT_TRUE(test::same_bits(expected, result)) << job;
    EXPECT_EQ(summary.quality_after.mirrored_count, std::ranges::count(some, 1));
  }
}

}  // namespace
}  // namespace meshsmooth

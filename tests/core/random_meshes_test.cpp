// Promises of every method on meshes that nobody has thought of. How many:
// MESHSMOOTH_RANDOM_MESHES, 1000 by default.

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>

#include "core/random_mesh.hpp"
#include "support/descent.hpp"
#include "support/input_surface.hpp"

namespace meshsmooth {
namespace {

using test::is_valid;
using test::mesh_count;
using test::points;
using test::RandomMesh;
using test::waved;

/// The volume (area) of each region.
std::map<int, double> region_volumes(const Mesh& mesh) {
  const std::vector<Vec3d> x = test::points_as_double(mesh);
  std::map<int, double> volumes;
  std::size_t element = 0;
  for (const ElementBlock& block : mesh.blocks) {
    const auto width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      Vec3d corners[8];
      for (std::size_t k = 0; k < width; ++k) corners[k] = x[block.nodes[at + k]];
      volumes[mesh.regions.empty() ? 0 : mesh.regions[element]] +=
          measure_element(block.type, corners, {0, 0, 0}).volume;
    }
  }
  return volumes;
}

TEST(RandomMeshes, NeverBecomeInvalidByAnyMethod) {
  const std::vector<test::Way> ways = test::ways(true);
  int moved = 0;
  std::int64_t slid = 0;
  for (int seed = 0; seed < mesh_count(); ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    Mesh mesh = random.valid();
    if (random.pick(0, 3) == 0 && is_valid(test::as_float32(mesh))) mesh = test::as_float32(mesh);
    std::vector<test::Way> tried = {ways[static_cast<std::size_t>(seed) % ways.size()]};
    for (const Goal goal : {Goal::average, Goal::balanced, Goal::worst}) {
      tried.push_back({"optimize", Optimize{.goal = goal}, Form::gauss_seidel});
    }
    for (const test::Way& way : tried) {
      SmoothOptions options{
          .method = way.method, .form = way.form, .max_iterations = random.pick(1, 30)};
      options.never_worse = false;  // the guard alone
      const int policy = random.pick(0, 4);
      if (policy == 0) options.boundary = BoundaryPolicy::free;
      if (policy >= 3) options.boundary = BoundaryPolicy::slide;
      if (random.pick(0, 4) == 0) {
        options.movement_limit = MovementLimit{.value = random.uniform(0.01, 0.3)};
      }

      const test::Job job = test::smooth(mesh, options);

      moved += job.summary.nodes.moved > 0 ? 1 : 0;
      EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << seed << " " << way.name;
      EXPECT_EQ(job.summary.quality_after.degenerate_count, 0) << seed << " " << way.name;
      if (policy == 0) continue;
      const NodeCounts& nodes = job.summary.nodes;
      slid += nodes.sliding_in_plane + nodes.sliding_on_line;
      EXPECT_LE(job.summary.deviation.result_to_input, job.summary.deviation.tolerance) << seed;
      if (nodes.sliding_on_surface + nodes.sliding_on_curve > 0) continue;
      const double rounding = mesh.positions.index() == 0 ? 1e-5 : 1e-11;
      const std::map<int, double> volumes = region_volumes(job.mesh);
      for (const auto& [region, volume] : region_volumes(mesh)) {
        EXPECT_NEAR(volumes.at(region), volume, rounding * volume) << seed << " " << way.name;
      }
    }
  }
  EXPECT_GT(moved, mesh_count());
  EXPECT_GT(slid, mesh_count());
}

TEST(RandomMeshes, KeepNodesOfCurvedPartsOnTheInputsFacets) {
  const std::vector<test::Way> ways = test::ways(true);
  std::int64_t slid = 0;
  for (int seed = 0; seed < mesh_count() / 4; ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    Mesh mesh = waved(random.valid(), random);
    if (!is_valid(mesh)) continue;
    if (random.pick(0, 3) == 0 && is_valid(test::as_float32(mesh))) mesh = test::as_float32(mesh);
    const bool surface = test::oracle::is_surface(mesh.blocks[0].type);
    for (const test::Way& way : {ways[static_cast<std::size_t>(seed) % ways.size()],
                                 test::Way{"optimize", Optimize{}, Form::gauss_seidel}}) {
      SmoothOptions options{.method = way.method,
                            .form = way.form,
                            .max_iterations = random.pick(1, 30),
                            .boundary = BoundaryPolicy::slide,
                            .feature_angle = random.uniform(20, 60),
                            .guard = random.pick(0, 4) != 0};

      const test::Job job = test::smooth(mesh, options);

      if (options.guard) {
        EXPECT_EQ(job.summary.quality_after.inverted_count, 0) << seed << " " << way.name;
        EXPECT_EQ(job.summary.quality_after.degenerate_count, 0) << seed << " " << way.name;
      }
      const NodeCounts& nodes = job.summary.nodes;
      const BoundaryDeviation& deviation = job.summary.deviation;
      EXPECT_LE(deviation.result_to_input, deviation.tolerance) << seed << " " << way.name;
      if (surface || nodes.sliding_on_surface + nodes.sliding_on_curve == 0) continue;
      slid += nodes.sliding_on_surface + nodes.sliding_on_curve;
      const test::InputSurface facets(mesh);
      std::set<NodeId> kept;
      for (const std::vector<NodeId>& of : test::constrained_facets(mesh)) {
        kept.insert(of.begin(), of.end());
      }
      const test::oracle::Points x = test::oracle::to_points(job.mesh);
      double farthest = 0;
      for (const NodeId n : kept) farthest = std::max(farthest, facets.distance(x[n]));
      EXPECT_LE(farthest, deviation.tolerance) << seed << " " << way.name;
      const test::oracle::Points before = test::oracle::to_points(mesh);
      for (const std::vector<NodeId>& of : test::constrained_facets(mesh)) {
        if (of.size() != 3) continue;
        const auto normal = [&](const test::oracle::Points& at) {
          return (at[of[1]] - at[of[0]]).cross(at[of[2]] - at[of[0]]).normalized();
        };
        EXPECT_GT(normal(x).dot(normal(before)), 0.49) << seed << " " << way.name;
      }
    }
  }
  EXPECT_GT(slid, mesh_count());
}

TEST(RandomMeshes, NeverGetMoreEnergyByASweep) {
  for (int seed = 0; seed < mesh_count() / 4; ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    const Mesh mesh = random.valid();
    for (const Goal goal : {Goal::average, Goal::balanced}) {
      const double p = goal == Goal::average ? 1 : 2;
      double before = test::oracle::mean_energy(mesh, p);
      for (int sweeps = 1; sweeps <= 4; ++sweeps) {
        const test::Job job =
            test::smooth(mesh, {.method = Optimize{.goal = goal, .target = Target::ideal},
                                .max_iterations = sweeps,
                                .tolerance = {0},
                                .never_worse = false});
        if (job.summary.convergence.iteration_count < sweeps) break;
        const double after = test::oracle::mean_energy(job.mesh, p);
        EXPECT_LE(after, before * (1 + 1e-13)) << seed;
        before = after;
      }
    }
  }
}

/// Reported energies: against the targets, with the anchors.
TEST(RandomMeshes, NeverGetMoreEnergyOfTheirTargetsByASweep) {
  int kinds[3] = {0, 0, 0};
  for (int seed = 0; seed < mesh_count(); ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    const Mesh mesh = random.valid();
    const Mesh reference = random.valid();
    SmoothOptions options{.max_iterations = 6, .tolerance = {0}, .history = true};
    Optimize method{.goal = random.pick(0, 1) == 0 ? Goal::average : Goal::balanced};
    if (random.pick(0, 2) == 0) method.stay = random.uniform(0, 2);
    const int kind = random.pick(0, 2);
    ++kinds[kind];
    JobInput input;
    if (kind == 0) input.reference = reference.positions_view();
    if (kind == 1) method.target = Target::input;
    if (random.pick(0, 2) == 0) options.boundary = BoundaryPolicy::slide;
    options.method = method;

    const test::Job job = test::smooth(mesh, options, input);

    EXPECT_TRUE(is_valid(job.mesh)) << seed;
    const std::vector<double>& energies = job.summary.convergence.energies;
    for (std::size_t sweep = 1; sweep < energies.size(); ++sweep) {
      EXPECT_LE(energies[sweep], energies[sweep - 1] * (1 + 1e-13)) << seed << " " << kind;
    }
  }
  for (const int count : kinds) EXPECT_GT(count, mesh_count() / 5);
}

TEST(RandomMeshes, KeepTheirValidElementsWhenTheyAreTangled) {
  int tangled = 0, repaired = 0;
  for (int seed = 0; seed < mesh_count() / 4; ++seed) {
    RandomMesh random(static_cast<unsigned>(seed));
    const Mesh mesh = random.thrown(random.uniform(0.5, 1.2));
    const std::int64_t inverted = measure_quality(mesh).inverted_count;
    if (inverted == 0 || inverted == static_cast<std::int64_t>(mesh.element_count())) continue;
    ++tangled;
    for (const Goal goal : {Goal::average, Goal::worst}) {
      SmoothOptions options{.method = Optimize{.goal = goal}};
      options.max_iterations = random.pick(1, 40);

      const test::Job job = test::smooth(mesh, options);

      EXPECT_TRUE(test::keeps_valid_elements(mesh, job.mesh)) << seed;
      repaired += job.summary.quality_after.inverted_count == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(tangled, mesh_count() / 20);
  EXPECT_GT(repaired, tangled / 2);
}

}  // namespace
}  // namespace meshsmooth

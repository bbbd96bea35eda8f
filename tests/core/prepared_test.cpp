// Topologies that are prepared once for many jobs.
#include <gtest/gtest.h>

#include <vector>

#include "core/prepared_ways.hpp"
#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/mesh_size.hpp"
#include "support/meshes.hpp"

namespace meshsmooth {
namespace {

using namespace std::chrono_literals;

/// The mesh, its nodes somewhere else.
Mesh moved(const Mesh& mesh, unsigned seed) { return test::noisy(mesh, 0.08, seed); }

test::Job run(const PreparedTopology& prepared, Mesh mesh, const SmoothOptions& options,
              int threads = 2) {
  const tbb::global_control enough(tbb::global_control::max_allowed_parallelism, 8);
  test::Job job{std::move(mesh), {}};
  job.summary = make_smoother("cpu", threads)
                    ->smooth(prepared, job.mesh.positions_span(), options, JobControl());
  return job;
}

std::vector<Mesh> meshes() {
  Mesh tetrahedra = test::lattice(ElementType::tetrahedron, 9);
  tetrahedra.fixed.assign(tetrahedra.node_count(), 0);
  tetrahedra.fixed[tetrahedra.node_count() / 2] = 1;
  Mesh regions = test::lattice(ElementType::tetrahedron, 5);
  for (std::size_t e = 0; e < regions.element_count(); ++e) {
    regions.regions.push_back(e < regions.element_count() / 2 ? 3 : 7);
  }
  return {tetrahedra, regions, test::mixed_stack(6), test::lattice(ElementType::triangle, 12),
          test::with_isolated_node(test::disconnected_pieces())};
}

TEST(Prepared, PositionsAreThoseOfAJobThatPreparesForItself) {
  for (const Mesh& mesh : meshes()) {
    const MeshTopology topology(mesh);
    const auto prepared = make_smoother("cpu", 2)->prepare(topology.view());
    for (const SmoothOptions& options : test::prepared_ways()) {
      const Mesh now = moved(mesh, 7);
      const test::Job expected = test::smooth(now, options);
      const test::Job job = run(*prepared, now, options);
      EXPECT_TRUE(test::same_bits(job.mesh, expected.mesh)) << method_name(options.method);
      EXPECT_EQ(job.summary.nodes.boundary, expected.summary.nodes.boundary);
      EXPECT_EQ(job.summary.nodes.moved, expected.summary.nodes.moved);
      EXPECT_EQ(job.summary.stop_reason, expected.summary.stop_reason);
    }
  }
}

TEST(Prepared, WritesTheResultWhereItIsTold) {
  const auto smoother = make_smoother("cpu", 2);
  for (const Mesh& mesh : meshes()) {
    test::reads_one_array_and_writes_another(*smoother, mesh);
  }
}

// Whatever was prepared first, by whichever thread count: no bit of the answer changes.
TEST(Prepared, JobsHaveTheSameBitsWhenPreparedAnew) {
  for (const Mesh& mesh : meshes()) {
    const MeshTopology topology(mesh);
    const auto first = make_smoother("cpu", 1)->prepare(topology.view());
    (void)run(*first, moved(mesh, 1), {});
    const auto again = make_smoother("cpu", 4)->prepare(topology.view());
    for (SmoothOptions options : test::prepared_ways()) {
      options.history = true;
      const Mesh now = moved(mesh, 2);
      const test::Job a = run(*first, now, options, 4);
      const test::Job b = run(*again, now, options, 1);
      EXPECT_TRUE(test::same_bits(a.mesh, b.mesh));
      EXPECT_EQ(a.summary.convergence.rms_displacements, b.summary.convergence.rms_displacements);
      EXPECT_EQ(a.summary.convergence.energies, b.summary.convergence.energies);
      EXPECT_EQ(a.summary.quality_after.sum_absolute_volume,
                b.summary.quality_after.sum_absolute_volume);
      EXPECT_EQ(a.summary.quality_after.metrics.front().mean,
                b.summary.quality_after.metrics.front().mean);
    }
  }
}

TEST(Prepared, TakesFloat32AndFloat64) {
  const Mesh mesh = test::lattice(ElementType::tetrahedron, 6);
  const MeshTopology topology(mesh);
  const auto prepared = make_smoother("cpu", 2)->prepare(topology.view());
  const Mesh now = test::as_float32(moved(mesh, 3));
  EXPECT_TRUE(test::same_bits(run(*prepared, now, {.method = SmartLaplacian{}}).mesh,
                              test::smooth(now, {.method = SmartLaplacian{}}).mesh));
}

TEST(Prepared, RefusesABadTopologyAtOnce) {
  Mesh mesh = test::tet_ball();
  mesh.blocks[0].nodes[0] = 99;
  const MeshTopology out_of_range(mesh);
  EXPECT_THROW((void)make_smoother("cpu")->prepare(out_of_range.view()), InvalidMesh);
  const Mesh overused = test::overused_facet();
  const MeshTopology topology(overused);
  EXPECT_THROW((void)make_smoother("cpu")->prepare(topology.view()), InvalidMesh);
}

TEST(Prepared, RefusesBadPositions) {
  Mesh mesh = test::tet_ball();
  const MeshTopology topology(mesh);
  const auto prepared = make_smoother("cpu")->prepare(topology.view());
  std::vector<Vec3d> few(3);
  EXPECT_THROW((void)make_smoother("cpu")->smooth(*prepared, std::span(few),
                                                  {.method = SmartLaplacian{}}, {}),
               InvalidMesh);
  test::points(mesh)[2].y = NAN;
  EXPECT_THROW((void)make_smoother("cpu")->smooth(*prepared, mesh.positions_span(),
                                                  {.method = SmartLaplacian{}}, {}),
               InvalidMesh);
}

TEST(Prepared, StopsWhenAsked) {
  const Mesh mesh = test::lattice(ElementType::tetrahedron, 6);
  const MeshTopology topology(mesh);
  std::stop_source stop;
  stop.request_stop();
  JobControl control;
  control.stop = stop.get_token();
  EXPECT_THROW((void)make_smoother("cpu")->prepare(topology.view(), control), Cancelled);
}

TEST(Prepared, IsBoundedByItsEstimate) {
  for (const Mesh& mesh :
       {test::lattice(ElementType::tetrahedron, 20), test::lattice(ElementType::hexahedron, 20),
        test::lattice(ElementType::triangle, 60)}) {
    const auto smoother = make_smoother("cpu", 2);
    const MeshTopology topology(mesh);
    const std::int64_t estimate = smoother->estimate_prepared(test::size_of(mesh)).host_bytes;
    const std::int64_t bytes = smoother->prepare(topology.view())->bytes().host_bytes;
    EXPECT_GE(estimate, bytes);
    EXPECT_LE(estimate, bytes + bytes / 5);
  }
}

// --- evaluating in brief ------------------------------------------------------------

TEST(BriefQuality, SaysTheSameOfWhatItSays) {
  for (const Mesh& mesh : meshes()) {
    SmoothOptions options;
    options.method = Laplacian{};
    options.max_iterations = 3;
    const Mesh now = test::noisy(mesh, 0.4, 5);  // tangled
    const test::Job full = test::smooth(now, options);
    options.quality_detail = QualityDetail::brief;
    const test::Job brief = test::smooth(now, options);
    EXPECT_TRUE(test::same_bits(full.mesh, brief.mesh));
    for (const auto& [a, b] :
         {std::pair{full.summary.quality_before, brief.summary.quality_before},
          std::pair{full.summary.quality_after, brief.summary.quality_after}}) {
      test::expect_brief_of(a, b);
    }
  }
}

}  // namespace
}  // namespace meshsmooth

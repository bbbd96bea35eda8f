// Topologies that are prepared once and stay on the device.

#include <gmock/gmock.h>

#include <array>
#include <thread>

#include "core/prepared_ways.hpp"
#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "meshsmooth/error.hpp"
#include "support/cuda_device.hpp"
#include "support/mesh_size.hpp"
#include "support/motions.hpp"

namespace meshsmooth {
namespace {

class CudaPrepared : public test::CudaTest {};

std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> all = test::tiny_meshes();
  for (test::NamedMesh& mesh : test::small_meshes()) all.push_back(std::move(mesh));
  Mesh regions = test::noisy(test::lattice(ElementType::tetrahedron, 9), 0.1, 4);
  for (std::size_t e = 0; e < regions.element_count(); ++e) {
    regions.regions.push_back(e < regions.element_count() / 2 ? 3 : 7);
  }
  all.emplace_back("regions", regions);
  return all;
}

test::Job run(Smoother& smoother, const PreparedTopology& prepared, Mesh mesh,
              const SmoothOptions& options, const JobInput& input = {}) {
  test::Job job{std::move(mesh), {}};
  JobPositions arrays(job.mesh.positions_span());
  arrays.input = input;
  job.summary = smoother.smooth(prepared, arrays, options, JobControl());
  return job;
}

std::array<std::int64_t, 8> counts_of(const test::Job& job) {
  const NodeCounts& nodes = job.summary.nodes;
  return {nodes.total,
          nodes.boundary,
          nodes.fixed,
          nodes.isolated,
          nodes.moved,
          nodes.between_regions,
          nodes.sliding_in_plane,
          nodes.on_non_manifold_edges};
}

TEST_F(CudaPrepared, PositionsAreThoseOfAJobThatPreparesForItself) {
  const auto smoother = make_smoother("cuda:0");
  for (const auto& [name, mesh] : meshes()) {
    const MeshTopology topology(mesh);
    const auto prepared = smoother->prepare(topology.view());
    for (const SmoothOptions& options : test::prepared_ways()) {
      SCOPED_TRACE(name + ", " + std::string(method_name(options.method)));
      const test::Job expected = test::smooth_on(*smoother, mesh, options);
      const test::Job job = run(*smoother, *prepared, mesh, options);
      EXPECT_TRUE(test::same_bits(job.mesh, expected.mesh));
      EXPECT_EQ(counts_of(job), counts_of(expected));
      EXPECT_EQ(job.summary.stop_reason, expected.summary.stop_reason);
      EXPECT_EQ(job.summary.quality_after.inverted_count,
                expected.summary.quality_after.inverted_count);
      EXPECT_EQ(prepared->boundary_node_count(), expected.summary.nodes.boundary);
    }
  }
}

TEST_F(CudaPrepared, WritesTheResultWhereItIsTold) {
  const auto smoother = make_smoother("cuda:0");
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    test::reads_one_array_and_writes_another(*smoother, mesh);
  }
}

// Whatever was prepared first, by whichever lane: no bit of the answer changes.
TEST_F(CudaPrepared, JobsHaveTheSameBitsWhenPreparedAnewByAnotherLane) {
  const auto one = make_smoother("cuda:0"), other = make_smoother("cuda:0");
  for (const auto& [name, mesh] : test::small_meshes()) {
    SCOPED_TRACE(name);
    const MeshTopology topology(mesh);
    const auto first = one->prepare(topology.view());
    (void)run(*one, *first, test::noisy(mesh, 0.01, 8), {});
    const auto again = other->prepare(topology.view());
    for (SmoothOptions options : test::prepared_ways()) {
      options.history = true;
      const test::Job a = run(*other, *first, mesh, options);
      const test::Job b = run(*one, *again, mesh, options);
      EXPECT_TRUE(test::same_bits(a.mesh, b.mesh));
      EXPECT_EQ(a.summary.convergence.rms_displacements, b.summary.convergence.rms_displacements);
      EXPECT_EQ(a.summary.convergence.energies, b.summary.convergence.energies);
      EXPECT_EQ(a.summary.quality_after.sum_absolute_volume,
                b.summary.quality_after.sum_absolute_volume);
    }
  }
}

TEST_F(CudaPrepared, ServesLanesAtOnceAndOutlivesTheOneThatMadeIt) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 15), 0.15, 3);
  const MeshTopology topology(mesh);
  const auto prepared = make_smoother("cuda:0")->prepare(topology.view());
  const test::Job expected = test::smooth_on(*make_smoother("cuda:0"), mesh, {});
  constexpr int kLanes = 4, kJobs = 8;
  int equal[kLanes] = {};
  {
    std::vector<std::jthread> lanes;
    for (int& count : equal) {
      lanes.emplace_back([&] {
        const auto smoother = make_smoother("cuda:0");
        for (int n = 0; n < kJobs; ++n) {
          const test::Job job = run(*smoother, *prepared, mesh, {});
          count += test::same_bits(job.mesh, expected.mesh) ? 1 : 0;
        }
      });
    }
  }
  EXPECT_THAT(equal, testing::Each(kJobs));
}

TEST_F(CudaPrepared, TakesFloat32AndMoves) {
  const auto smoother = make_smoother("cuda:0");
  const test::Motion motion = test::turned_hub(24, 30);
  const MeshTopology topology(motion.reference);
  const auto prepared = smoother->prepare(topology.view());
  for (const Mesh& mesh : {motion.reference, test::as_float32(motion.reference)}) {
    const test::Job expected = test::smooth_on(*smoother, mesh, motion.options(), motion.input());
    const test::Job job = run(*smoother, *prepared, mesh, motion.options(), motion.input());
    EXPECT_EQ(job.summary.motion.value().reached, 1);
    EXPECT_LE(test::difference(job.mesh, test::oracle::to_points(expected.mesh)), 1e-4);
  }
}

TEST_F(CudaPrepared, RefusesABadTopologyAtOnce) {
  const auto smoother = make_smoother("cuda:0");
  Mesh mesh = test::tet_ball();
  mesh.blocks[0].nodes[0] = 99;
  const MeshTopology out_of_range(mesh);
  EXPECT_THROW((void)smoother->prepare(out_of_range.view()), InvalidMesh);
  const Mesh overused = test::overused_facet();
  const MeshTopology topology(overused);
  EXPECT_THROW((void)smoother->prepare(topology.view()), InvalidMesh);
}

TEST_F(CudaPrepared, RefusesBadPositionsAndStopsWhenAsked) {
  const auto smoother = make_smoother("cuda:0");
  Mesh mesh = test::tet_ball();
  const MeshTopology topology(mesh);
  const auto prepared = smoother->prepare(topology.view());
  std::vector<Vec3d> few(3);
  EXPECT_THROW((void)smoother->smooth(*prepared, std::span(few), {}, {}), InvalidMesh);
  test::points(mesh)[2].y = NAN;
  EXPECT_THROW((void)smoother->smooth(*prepared, mesh.positions_span(), {}, {}), InvalidMesh);
  std::stop_source stop;
  stop.request_stop();
  JobControl control;
  control.stop = stop.get_token();
  EXPECT_THROW((void)smoother->prepare(topology.view(), control), Cancelled);
}

TEST_F(CudaPrepared, IsBoundedByItsEstimate) {
  const auto smoother = make_smoother("cuda:0");
  for (const Mesh& mesh :
       {test::lattice(ElementType::tetrahedron, 29), test::lattice(ElementType::hexahedron, 40),
        test::lattice(ElementType::triangle, 200)}) {
    const MeshTopology topology(mesh);
    const std::int64_t estimate = smoother->estimate_prepared(test::size_of(mesh)).device_bytes;
    const std::int64_t bytes = smoother->prepare(topology.view())->bytes().device_bytes;
    EXPECT_GE(estimate, bytes);
    EXPECT_LE(estimate, bytes + bytes / 5);
  }
}

}  // namespace
}  // namespace meshsmooth

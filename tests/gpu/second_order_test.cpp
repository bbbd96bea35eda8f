// Meshes of second order on CUDA: the corners have the bits of the linear mesh's job there.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/mesh_size.hpp"
#include "support/second_order.hpp"

namespace meshsmooth {
namespace {

class CudaSecondOrder : public test::CudaTest {};

TEST_F(CudaSecondOrder, CornersHaveTheBitsOfTheLinearMesh) {
  const auto smoother = make_smoother("cuda:0");
  for (const ElementType type : kLinearTypes) {
    const Mesh linear = test::noisy(test::lattice(type, 8), 0.15, 3);
    for (const Method& method : {Method(Optimize{}), Method(Laplacian{}), Method(Taubin{})}) {
      SmoothOptions options{.method = method, .max_iterations = 6};
      Mesh corners = linear, mesh = test::second_order(linear, true);
      smoother->smooth(corners, options);

      const SmoothSummary summary = smoother->smooth(mesh, options);

      EXPECT_EQ(summary.backend, "cuda:0");
      EXPECT_EQ(summary.quality_after.inverted_count, 0);
      for (std::size_t n = 0; n < corners.node_count(); ++n) {
        ASSERT_EQ(test::points(mesh)[n], test::points(corners)[n])
            << element_name(type) << ", " << method_name(method);
      }
    }
  }
}

TEST_F(CudaSecondOrder, CurvedElementsStayValidAsOnTheCpu) {
  const Mesh start = test::mapped(
      test::second_order(test::noisy(test::lattice(ElementType::tetrahedron, 10), 0.08, 5)),
      [](Vec3d p) {
        const double angle = 0.15 * p.x, radius = 10 + p.y;
        return Vec3d{radius * std::sin(angle), radius * std::cos(angle), p.z};
      });
  ASSERT_EQ(measure_quality(start).inverted_count, 0);
  const auto smoother = make_smoother("cuda:0"), host = make_smoother("cpu", 2);
  Mesh mesh = start, again = start, expected = start;

  const SmoothSummary summary = smoother->smooth(mesh, SmoothOptions{});
  smoother->smooth(again, SmoothOptions{});
  host->smooth(expected, SmoothOptions{});

  EXPECT_EQ(test::points(mesh), test::points(again));
  EXPECT_GT(summary.nodes.moved, 0);
  const QualityStats quality = measure_quality(mesh), on_host = measure_quality(expected);
  EXPECT_EQ(quality.inverted_count + quality.degenerate_count, 0);
  EXPECT_NEAR(quality.worst.front().mean_ratio, on_host.worst.front().mean_ratio, 0.02);
}

TEST_F(CudaSecondOrder, StaysPrepared) {
  const Mesh start =
      test::second_order(test::noisy(test::lattice(ElementType::tetrahedron, 8), 0.15, 3));
  const MeshTopology topology(start);
  const auto smoother = make_smoother("cuda:0");
  const auto prepared = smoother->prepare(topology.view());
  Mesh first = start, second = start;

  smoother->smooth(*prepared, first.positions_span(), SmoothOptions{}, {});
  smoother->smooth(*prepared, second.positions_span(), SmoothOptions{}, {});

  EXPECT_EQ(test::points(first), test::points(second));
  EXPECT_EQ(measure_quality(first).inverted_count, 0);
  const MemoryEstimate estimate = smoother->estimate_prepared(test::size_of(start));
  EXPECT_LE(prepared->bytes().device_bytes, estimate.device_bytes);
  EXPECT_LE(prepared->bytes().host_bytes, estimate.host_bytes);
}

}  // namespace
}  // namespace meshsmooth

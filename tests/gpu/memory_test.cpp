// The estimate by which the server admits jobs against what a job takes on the device.

#include <gtest/gtest.h>

#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/mesh_size.hpp"

namespace meshsmooth {
namespace {

/// One mesh of each kind with at least 100,000 elements.
const std::vector<test::NamedMesh>& large_meshes() {
  static const std::vector<test::NamedMesh> meshes = {
      {"triangle", test::noisy(test::lattice(ElementType::triangle, 227), 0.1, 1)},
      {"quad", test::noisy(test::lattice(ElementType::quad, 321), 0.1, 1)},
      {"tetrahedron", test::noisy(test::lattice(ElementType::tetrahedron, 29), 0.1, 1)},
      {"pyramid", test::noisy(test::lattice(ElementType::pyramid, 29), 0.1, 1)},
      {"wedge", test::noisy(test::lattice(ElementType::wedge, 37), 0.1, 1)},
      {"hexahedron", test::noisy(test::lattice(ElementType::hexahedron, 47), 0.1, 1)},
      {"mixed", test::noisy(test::mixed_stack(87), 0.1, 1)},
      {"sphere", test::sphere(7)},
  };
  return meshes;
}

class DeviceMemoryOf : public test::CudaTest, public testing::WithParamInterface<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Cuda, DeviceMemoryOf, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(DeviceMemoryOf, IsBoundedByTheEstimateToTwentyPercent) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const auto& [name, mesh] : large_meshes()) {
    ASSERT_GE(mesh.element_count(), 100000U) << name;
    const bool optimizes = std::holds_alternative<Optimize>(GetParam().method);
    const Mesh given = optimizes ? test::wavy_if_surface(mesh) : mesh;
    for (const Mesh& start : {given, test::as_float32(given)}) {
      for (const bool guard : {false, true}) {
        SCOPED_TRACE(name + (start.positions.index() == 1 ? ", float64" : ", float32") +
                     (guard ? ", guarded" : ", bare"));
        SmoothOptions options = test::sweeps(2, GetParam().method, GetParam().form);
        options.guard = guard;
        const std::int64_t estimate =
            smoother->estimate(test::size_of(start), options).device_bytes;
        Mesh smoothed = start;

        const std::int64_t peak = smoother->smooth(smoothed, options).device_peak_bytes;

        EXPECT_GE(estimate, peak);
        EXPECT_LE(static_cast<double>(estimate), 1.2 * static_cast<double>(peak));
      }
    }
  }
}

TEST_P(DeviceMemoryOf, IsBoundedByTheEstimateWhileNodesOfCurvedPartsSlide) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const auto& [name, mesh] : large_meshes()) {
    SCOPED_TRACE(name);
    SmoothOptions options = test::sweeps(2, GetParam().method, GetParam().form);
    options.boundary = BoundaryPolicy::slide;
    Mesh curved = test::mapped(mesh, [](Vec3d p) {
      return Vec3d{p.x, p.y + std::sin(0.1 * p.x), p.z};
    });
    const std::int64_t estimate = smoother->estimate(test::size_of(curved), options).device_bytes;

    EXPECT_GE(estimate, smoother->smooth(curved, options).device_peak_bytes);
  }
}

class DeviceMemory : public test::CudaTest {};

TEST_F(DeviceMemory, OfRegionsUnderAFixedBoundaryIsBoundedByTheEstimate) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const auto& [name, mesh] : large_meshes()) {
    SCOPED_TRACE(name);
    Mesh halves = mesh;
    halves.regions.assign(mesh.element_count() / 2, 1);
    halves.regions.resize(mesh.element_count(), 2);
    for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}, Optimize{}}) {
      const SmoothOptions options = test::sweeps(2, method, Form::automatic);
      const std::int64_t estimate = smoother->estimate(test::size_of(halves), options).device_bytes;
      Mesh smoothed =
          std::holds_alternative<Optimize>(method) ? test::wavy_if_surface(halves) : halves;

      const SmoothSummary summary = smoother->smooth(smoothed, options);

      EXPECT_GT(summary.nodes.between_regions, 0);
      EXPECT_GE(estimate, summary.device_peak_bytes);
      EXPECT_LE(static_cast<double>(estimate),
                1.25 * static_cast<double>(summary.device_peak_bytes));
    }
  }
}

/// Optimize holds most in long descents; with poor elements counted, after short ones.
TEST_F(DeviceMemory, OfALongDescentIsBoundedByTheEstimate) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  for (const ElementType type : kLinearTypes) {
    const int n = test::oracle::is_surface(type) ? 225 : type == ElementType::pyramid ? 29 : 37;
    const Mesh mesh = test::long_error(type, n);
    for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
      for (const SmoothOptions& options :
           {SmoothOptions{.max_iterations = 20},
            SmoothOptions{.max_iterations = 2, .report_below = 0.9}}) {
        SCOPED_TRACE(std::string(element_name(type)) + ", " +
                     std::to_string(*options.max_iterations));
        const std::int64_t estimate =
            smoother->estimate(test::size_of(start), options).device_bytes;
        Mesh smoothed = start;
        const std::int64_t peak = smoother->smooth(smoothed, options).device_peak_bytes;
        EXPECT_GE(estimate, peak);
        EXPECT_LE(static_cast<double>(estimate), 1.2 * static_cast<double>(peak));
      }
    }
  }
}

TEST_F(DeviceMemory, DoesNotGrowFromJobToJob) {
  const std::unique_ptr<Smoother> smoother = make_smoother("cuda");
  const auto& [name, mesh] = large_meshes()[2];
  const SmoothOptions options = test::sweeps(2, SmartLaplacian{}, Form::automatic);
  Mesh first = mesh;
  const std::int64_t peak = smoother->smooth(first, options).device_peak_bytes;
  for (int job = 0; job < 5; ++job) {
    Mesh again = mesh;

    EXPECT_EQ(smoother->smooth(again, options).device_peak_bytes, peak) << "job " << job;
  }
}

}  // namespace
}  // namespace meshsmooth

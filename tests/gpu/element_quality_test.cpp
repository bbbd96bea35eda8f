// Metrics of every element and brief reports of the CUDA backend, through the public API.

#include <gmock/gmock.h>

#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "meshsmooth/canonical_topology.hpp"
#include "support/cuda_device.hpp"
#include "support/element_values.hpp"
#include "support/mesh_size.hpp"
#include "support/random_elements.hpp"

namespace meshsmooth {
namespace {

const std::vector<QualityMetric> kAll(kQualityMetrics.begin(), kQualityMetrics.end());

std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> result = test::tiny_meshes();
  for (const auto& mesh : test::small_meshes()) result.push_back(mesh);
  result.emplace_back("scattered_blocks", test::scattered_blocks(17));
  return result;
}

class CudaElementQuality : public test::CudaTest {};

TEST_F(CudaElementQuality, IsThatOfTheResultInTheCallersOrder) {
  const auto smoother = make_smoother("cuda");
  const SmoothOptions options = {
      .method = SmartLaplacian{}, .max_iterations = 3, .element_quality_metrics = kAll};
  for (const auto& [name, mesh] : meshes()) {
    for (const Mesh& start : {mesh, test::as_float32(mesh)}) {
      SCOPED_TRACE(name + (start.positions.index() == 1 ? ", float64" : ", float32"));
      const MeshTopology topology(start);
      const SurfaceOrientation orientation(topology.view(), start.positions_view());
      Mesh after = start;

      const ElementQualityArrays found = smoother->smooth(after, options).element_quality;

      const ElementQualityArrays expected =
          measure_elements(topology.view(), after.positions_view(), orientation, kAll);
      EXPECT_EQ(found.metrics, kAll);
      ASSERT_EQ(found.values.size(), expected.values.size());
      for (std::size_t i = 0; i < found.values.size(); ++i) {
        ASSERT_TRUE(test::close_or_both_nan(found.values[i], expected.values[i]))
            << "value " << i << ": " << found.values[i] << ", expected " << expected.values[i];
      }
    }
  }
}

TEST_F(CudaElementQuality, IsAbsentUnlessAskedFor) {
  Mesh mesh = test::tet_ball();

  const SmoothSummary summary = make_smoother("cuda")->smooth(mesh, {.max_iterations = 1});

  EXPECT_TRUE(summary.element_quality.metrics.empty());
  EXPECT_TRUE(summary.element_quality.values.empty());
}

TEST_F(CudaElementQuality, TakesNoMoreMemoryThanEstimated) {
  const auto smoother = make_smoother("cuda");
  for (const ElementType type : kLinearTypes) {
    const int n = element_shape(type).dimension == 2 ? 321 : 47;
    const Mesh start = test::noisy(test::lattice(type, n), 0.1, 1);
    for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}, Optimize{}}) {
      for (const std::size_t count : {std::size_t{1}, kAll.size()}) {
        SCOPED_TRACE(std::string(element_name(type)) + ", " + std::string(method_name(method)) +
                     ", " + std::to_string(count) + " metrics");
        SmoothOptions options = test::sweeps(2, method, Form::automatic);
        options.element_quality_metrics.assign(kAll.begin(),
                                               kAll.begin() + static_cast<std::ptrdiff_t>(count));
        const MemoryEstimate estimate = smoother->estimate(test::size_of(start), options);
        Mesh mesh = std::holds_alternative<Optimize>(method) ? test::wavy_if_surface(start) : start;

        const SmoothSummary summary = smoother->smooth(mesh, options);

        EXPECT_GE(estimate.device_bytes, summary.device_peak_bytes);
        EXPECT_LE(static_cast<double>(estimate.device_bytes),
                  1.2 * static_cast<double>(summary.device_peak_bytes));
        EXPECT_GE(estimate.host_bytes,
                  static_cast<std::int64_t>(summary.element_quality.values.size() * sizeof(float)));
      }
    }
  }
}

/// Disjoint ones.
Mesh random_elements(ElementType type, double size, std::mt19937_64& random) {
  Mesh mesh = test::make_mesh({}, {{type, {}}});
  for (int e = 0; e < test::random_element_count(); ++e) {
    for (const Vec3d& corner : test::thrown_corners(type, size, random)) {
      mesh.blocks[0].nodes.push_back(static_cast<NodeId>(mesh.node_count()));
      test::points(mesh).push_back(corner);
    }
  }
  return mesh;
}

/// The CPU's validity between corners is tested against interval subdivision.
class CudaCertifyElements : public test::CudaTest,
                            public testing::WithParamInterface<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Types, CudaCertifyElements, testing::ValuesIn(test::kTypesWithAnInside),
                         [](const auto& type) { return std::string(element_name(type.param)); });

TEST_P(CudaCertifyElements, AgreesWithTheCpu) {
  const auto smoother = make_smoother("cuda");
  const ElementType type = GetParam();
  std::mt19937_64 random(17);
  std::int64_t valid = 0, hidden = 0;
  for (const double size : test::kThrownSizes) {
    Mesh mesh = random_elements(type, size, random);
    const MeshTopology topology(mesh);
    const CanonicalTopology canonical(topology.view(), mesh.positions_view());
    const SurfaceOrientation orientation(canonical.view(), mesh.positions_view());
    const QualityStats expected = measure_quality(mesh);
    const std::vector<float> jacobians =
        measure_elements(canonical.view(), mesh.positions_view(), orientation,
                         {QualityMetric::scaled_jacobian})
            .values;

    const SmoothSummary summary = smoother->smooth(
        mesh, {.max_iterations = 0, .element_quality_metrics = {QualityMetric::scaled_jacobian}});

    EXPECT_EQ(summary.quality_after.inverted_count, expected.inverted_count) << size;
    EXPECT_EQ(summary.quality_after.degenerate_count, expected.degenerate_count) << size;
    const std::vector<float>& found = summary.element_quality.values;
    ASSERT_EQ(found.size(), jacobians.size());
    for (std::size_t e = 0; e < found.size(); ++e) {
      ASSERT_TRUE(test::close_or_both_nan(found[e], jacobians[e])) << size << " " << e;
      ASSERT_EQ(found[e] > 0, jacobians[e] > 0) << size << " " << e;
    }
    valid += expected.element_count - expected.inverted_count - expected.degenerate_count;
    hidden += std::ranges::count_if(found, [](float jacobian) { return jacobian > 0; });
  }
  hidden -= valid;
  EXPECT_GT(valid, 0);
  if (type == ElementType::hexahedron || type == ElementType::wedge) {
    EXPECT_GT(hidden, 0);
  }
}

class CudaBriefQuality : public test::CudaTest {};

TEST_F(CudaBriefQuality, SaysTheSameOfWhatItSays) {
  const auto smoother = make_smoother("cuda");
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    SmoothOptions options = {.method = Laplacian{}, .max_iterations = 3};
    Mesh full_mesh = mesh, brief_mesh = mesh;
    const SmoothSummary full = smoother->smooth(full_mesh, options);
    options.quality_detail = QualityDetail::brief;

    const SmoothSummary brief = smoother->smooth(brief_mesh, options);

    EXPECT_TRUE(test::same_bits(full_mesh, brief_mesh));
    for (const auto& [a, b] : {std::pair{full.quality_before, brief.quality_before},
                               std::pair{full.quality_after, brief.quality_after}}) {
      EXPECT_FALSE(a.metrics.empty());
      test::expect_brief_of(a, b);
    }
    EXPECT_EQ(full.locked.element_count, brief.locked.element_count);
    EXPECT_EQ(full.locked.inverted_count, brief.locked.inverted_count);
  }
}

}  // namespace
}  // namespace meshsmooth

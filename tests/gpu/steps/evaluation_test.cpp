// What the CUDA backend finds out about a result, and how it returns it to the caller.

#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/flatten.hpp"
#include "gpu/steps/step_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/element_values.hpp"

namespace meshsmooth {
namespace {

using test::DeviceEvaluation;
using test::evaluate_on_device;
using test::FlatMesh;
using test::flatten;

/// A job's result: every node of `flat` moved by up to `amplitude`, fixed ones too, which must not
/// show; in a plane mesh within its plane.
void move_nodes(FlatMesh& flat, double amplitude) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> noise(-amplitude, amplitude);
  const bool plane = flat.dimension == 2 && flat.references.empty();
  for (Vec3d& p : flat.positions) {
    const Vec3d move = {noise(random), noise(random), plane ? 0.0 : noise(random)};
    p += move;
  }
}

/// The caller's mesh with the positions of the result.
Mesh result_of(const Mesh& mesh, const FlatMesh& flat) {
  Mesh after = mesh;
  test::points(after) = flat.in_callers_order(flat.positions);
  return after;
}

void expect_close(double found, double expected) {
  EXPECT_NEAR(found, expected, 1e-9 * std::max(1.0, std::abs(expected)));
}

void expect_equal(const QualityStats& found, const QualityStats& expected, bool irregular) {
  EXPECT_EQ(found.element_count, expected.element_count);
  EXPECT_EQ(found.inverted_count, expected.inverted_count);
  EXPECT_EQ(found.degenerate_count, expected.degenerate_count);
  expect_close(found.sum_absolute_volume, expected.sum_absolute_volume);
  expect_close(found.enclosed_volume, expected.enclosed_volume);
  ASSERT_EQ(found.metrics.size(), expected.metrics.size());
  for (std::size_t m = 0; m < found.metrics.size(); ++m) {
    const MetricStats& a = found.metrics[m];
    const MetricStats& b = expected.metrics[m];
    SCOPED_TRACE(metric_name(b.metric));
    EXPECT_EQ(a.metric, b.metric);
    EXPECT_EQ(a.element_count, b.element_count);
    expect_close(a.min, b.min);
    expect_close(a.mean, b.mean);
    expect_close(a.max, b.max);
    // A value on the edge of a bin may fall on either side.
    EXPECT_NEAR(a.percentile_1, b.percentile_1,
                1.001 * (b.histogram_upper - b.histogram_lower) / 2048);
    ASSERT_EQ(a.histogram.size(), b.histogram.size());
    EXPECT_EQ(std::accumulate(a.histogram.begin(), a.histogram.end(), std::int64_t{0}),
              a.element_count);
    // Regular elements have values on the edges of bins.
    if (irregular) {
      EXPECT_EQ(a.histogram, b.histogram);
    }
  }
  ASSERT_EQ(found.worst.size(), expected.worst.size());
  for (std::size_t w = 0; w < found.worst.size(); ++w) {
    expect_close(found.worst[w].mean_ratio, expected.worst[w].mean_ratio);
  }
}

class CudaEvaluation : public test::CudaTest {};

TEST_F(CudaEvaluation, FindsTheQualityThatTheHostMeasures) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    for (const double amplitude : {0.0, 0.05, 0.4}) {
      SCOPED_TRACE(name + ", moved by " + std::to_string(amplitude));
      FlatMesh flat = flatten(mesh);
      move_nodes(flat, amplitude);
      const Mesh after = result_of(mesh, flat);
      const MeshTopology topology(mesh);
      const SurfaceOrientation orientation(topology.view(), mesh.positions_view());

      const DeviceEvaluation found = evaluate_on_device(mesh, flat);

      expect_equal(found.quality,
                   measure_quality(topology.view(), after.positions_view(), orientation),
                   amplitude > 0);
    }
  }
}

TEST_F(CudaEvaluation, FindsTheWorstElementOfTheOracle) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::lattice(type, 4);
    FlatMesh flat = flatten(mesh);
    move_nodes(flat, 0.25);
    const auto x = test::oracle::to_points(result_of(mesh, flat));
    std::int64_t worst = -1, id = 0, inverted = 0;
    double ratio = HUGE_VAL;
    for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
      const double own = test::oracle::quality(type, test::oracle::corners(e, x)).mean_ratio;
      inverted += own < 0 ? 1 : 0;
      if (own < ratio) {
        ratio = own;
        worst = id;
      }
      ++id;
    }

    const QualityStats found = evaluate_on_device(mesh, flat).quality;

    EXPECT_EQ(found.inverted_count, inverted) << element_name(type);
    EXPECT_EQ(found.worst.front().element, worst) << element_name(type);
    EXPECT_EQ(found.worst.front().type, type);
    EXPECT_NEAR(found.worst.front().mean_ratio, ratio, 1e-12) << element_name(type);
  }
}

/// More elements with the worst mean ratio than the device lists.
TEST_F(CudaEvaluation, ListsTheWorstByTheCallersIdsWhereAllAreAlike) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 8);

  const QualityStats found = evaluate_on_device(mesh, flatten(mesh)).quality;

  ASSERT_EQ(found.worst.size(), 10U);
  for (std::size_t w = 0; w < found.worst.size(); ++w) {
    EXPECT_EQ(found.worst[w].element, static_cast<std::int64_t>(w));
    EXPECT_NEAR(found.worst[w].mean_ratio, 1, 1e-12);
  }
}

TEST_F(CudaEvaluation, CountsElementsWhoseNodesAreAllFixed) {
  auto meshes = test::step_meshes();
  meshes.emplace_back("scattered_blocks", test::scattered_blocks());
  meshes.emplace_back("masked",
                      test::with_mask(test::noisy(test::lattice(ElementType::wedge, 4), 0.1, 3)));
  for (const auto& [name, mesh] : meshes) {
    const FlatMesh flat = flatten(mesh);
    const std::vector<bool> held = test::oracle::held_nodes(mesh);
    std::int64_t locked = 0;
    for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
      const bool all = std::all_of(e.nodes.begin(), e.nodes.end(),
                                   [&](NodeId n) { return held[static_cast<std::size_t>(n)]; });
      locked += all ? 1 : 0;
    }

    const LockedStats found = evaluate_on_device(mesh, flat).locked;

    EXPECT_EQ(found.element_count, locked) << name;
    EXPECT_EQ(found.worst.has_value(), locked > 0) << name;
  }
}

TEST_F(CudaEvaluation, OmitsNothingButTheMetricsInBrief) {
  auto meshes = test::step_meshes();
  meshes.emplace_back("alike", test::lattice(ElementType::hexahedron, 8));  // more than are listed
  for (const auto& [name, mesh] : meshes) {
    for (const double amplitude : {0.0, 0.4}) {
      SCOPED_TRACE(name + ", moved by " + std::to_string(amplitude));
      FlatMesh flat = flatten(mesh);
      move_nodes(flat, amplitude);
      DeviceEvaluation full = evaluate_on_device(mesh, flat);

      const DeviceEvaluation brief = evaluate_on_device(mesh, flat, QualityDetail::brief);

      full.quality.metrics.clear();
      expect_equal(brief.quality, full.quality, true);
      for (std::size_t w = 0; w < full.quality.worst.size(); ++w) {
        EXPECT_EQ(brief.quality.worst[w].element, full.quality.worst[w].element);
        EXPECT_EQ(brief.quality.worst[w].scaled_jacobian, full.quality.worst[w].scaled_jacobian);
      }
      EXPECT_EQ(brief.locked.element_count, full.locked.element_count);
      EXPECT_EQ(brief.locked.inverted_count, full.locked.inverted_count);
      ASSERT_EQ(brief.locked.worst.has_value(), full.locked.worst.has_value());
      if (full.locked.worst) {
        EXPECT_EQ(brief.locked.worst->element, full.locked.worst->element);
        EXPECT_EQ(brief.locked.worst->scaled_jacobian, full.locked.worst->scaled_jacobian);
      }
    }
  }
}

TEST_F(CudaEvaluation, MeasuresEveryElementAsTheHostInTheCallersOrder) {
  auto meshes = test::step_meshes();
  meshes.emplace_back("scattered_blocks", test::scattered_blocks(11));
  for (const auto& [name, mesh] : meshes) {
    for (const double amplitude : {0.0, 0.05, 0.4}) {
      SCOPED_TRACE(name + ", moved by " + std::to_string(amplitude));
      FlatMesh flat = flatten(mesh);
      move_nodes(flat, amplitude);
      const Mesh after = result_of(mesh, flat);
      const MeshTopology topology(mesh);
      const ElementQualityArrays expected =
          measure_elements(topology.view(), after.positions_view(),
                           SurfaceOrientation(topology.view(), mesh.positions_view()),
                           {kQualityMetrics.begin(), kQualityMetrics.end()});

      const ElementQualityArrays found = evaluate_on_device(mesh, flat).elements;

      EXPECT_EQ(found.metrics, expected.metrics);
      ASSERT_EQ(found.values.size(), expected.values.size());
      for (std::size_t i = 0; i < found.values.size(); ++i) {
        ASSERT_TRUE(test::close_or_both_nan(found.values[i], expected.values[i])) << i;
      }
    }
  }
}

class CudaWriteBack : public test::CudaTest {};

TEST_F(CudaWriteBack, GivesTheCallerAllNodesInHisOrder) {  // prescribed ones are held and move
  for (const auto& [name, exact] : test::step_meshes()) {
    for (const bool float32 : {false, true}) {
      const Mesh mesh = float32 ? test::as_float32(exact) : exact;
      FlatMesh flat = flatten(exact);
      move_nodes(flat, 0.1);
      const std::vector<Vec3d> given = test::points_as_double(mesh);
      std::vector<Vec3d> expected = flat.in_callers_order(flat.positions);
      std::int64_t count = 0;
      for (std::size_t n = 0; n < expected.size(); ++n) {
        if (float32) expected[n] = test::rounded_to_float32(expected[n]);
        if (!(expected[n] == given[n])) ++count;
      }

      const DeviceEvaluation found = evaluate_on_device(mesh, flat);

      EXPECT_EQ(found.written, expected) << name;
      EXPECT_EQ(found.moved, count) << name;
    }
  }
}

TEST_F(CudaWriteBack, CountsNoNodeThatIsWhereItWas) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 3);

  EXPECT_EQ(evaluate_on_device(mesh, flatten(mesh)).moved, 0);
}

}  // namespace
}  // namespace meshsmooth

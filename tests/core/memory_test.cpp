// The size model against what a job really allocates: every `new` of the program
// is counted.

#include <gmock/gmock.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "core/smoothing.hpp"
#include "support/fit_surfaces.hpp"
#include "support/mesh_size.hpp"
#include "support/second_order.hpp"

namespace {

std::atomic<std::int64_t> bytes_now = 0;
std::atomic<std::int64_t> bytes_peak = 0;

void* counted(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  const std::int64_t now = bytes_now += static_cast<std::int64_t>(malloc_usable_size(memory));
  std::int64_t peak = bytes_peak;
  while (now > peak && !bytes_peak.compare_exchange_weak(peak, now)) {
  }
  return memory;
}

void uncounted(void* memory) {
  if (memory != nullptr) bytes_now -= static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return counted(std::malloc(size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto a = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(a, (size + a - 1) / a * a));
}
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return operator new(size, alignment);
}
void operator delete(void* memory) noexcept { uncounted(memory); }
void operator delete(void* memory, std::size_t) noexcept { uncounted(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { uncounted(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { uncounted(memory); }

namespace meshsmooth {
namespace {

/// The estimate is no less than what is counted, and at most `slack` times what the
/// summary says.
void expect_bounded(const std::string& name, Mesh mesh, const SmoothOptions& options,
                    double slack = 1.2, const JobInput& input = {}) {
  ASSERT_GE(mesh.node_count(), 50000U) << name;
  const std::unique_ptr<Smoother> smoother = make_smoother("cpu", 2);
  const std::int64_t estimate = smoother->estimate(test::size_of(mesh, input), options).host_bytes;
  const std::int64_t before = bytes_now;
  bytes_peak = before;

  const SmoothSummary summary = smoother->smooth(mesh, options, {}, input);

  const std::int64_t told = summary.host_peak_bytes;
  // The values that the summary returns are on the heap and among the buffers.
  const auto returned =
      static_cast<std::int64_t>(summary.element_quality.values.size() * sizeof(float));
  const std::int64_t counted_bytes = bytes_peak - before - returned;
  EXPECT_LE(told, estimate) << name;
  EXPECT_LE(static_cast<double>(estimate), slack * static_cast<double>(told)) << name;
  EXPECT_LE(told + counted_bytes, estimate) << name << ": the heap beside the buffers";
}

Mesh large(ElementType type) {
  const int n = test::oracle::is_surface(type) ? 225 : type == ElementType::pyramid ? 29 : 37;
  return test::noisy(test::lattice(type, n), 0.1, 1);
}

class EveryWay : public testing::TestWithParam<test::Way> {};
INSTANTIATE_TEST_SUITE_P(Estimate, EveryWay, testing::ValuesIn(test::ways(true)), test::way_name);

TEST_P(EveryWay, BoundsTheMemoryOfATetrahedralMesh) {
  static const Mesh mesh = large(ElementType::tetrahedron);
  SmoothOptions options = test::sweeps(1, GetParam().method, GetParam().form);
  expect_bounded("bare", mesh, options);
  options.guard = true;
  expect_bounded("guarded", mesh, options);
}

/// A motion as long as the mesh, which is split, untangled or descended by global steps, as far as
/// the sweeps last.
TEST(Estimate, BoundsTheMemoryOfAMotion) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = large(type);
    const std::vector<NodeId> nodes = find_boundary_nodes(MeshTopology(mesh).view());
    std::vector<Vec3d> positions;
    for (const NodeId node : nodes) {
      const Vec3d p = std::get<std::vector<Vec3d>>(mesh.positions)[static_cast<std::size_t>(node)];
      positions.push_back(p + Vec3d{0.3 * p.y, 9 * std::sin(0.1 * p.x), 0});
    }
    SmoothOptions options{.method = Move{}, .quality_detail = QualityDetail::brief};
    const JobInput input{.prescribed = {nodes, std::span<const Vec3d>(positions)}};
    for (const int sweeps : {4, 20}) {
      options.max_iterations = sweeps;
      const std::string name = std::string(element_name(type)) + ", " + std::to_string(sweeps);
      expect_bounded(name, mesh, options, test::oracle::is_surface(type) ? 3 : 2, input);
    }
  }
}

TEST(Estimate, BoundsTheMemoryOfDerivatives) {
  for (const ElementType type :
       {ElementType::tetrahedron, ElementType::hexahedron, ElementType::triangle}) {
    const Mesh mesh = large(type);
    const std::vector<NodeId> nodes = find_boundary_nodes(MeshTopology(mesh).view());
    const std::vector<Vec3d> tangents(nodes.size(), {1, 2, 3});
    const std::vector<Vec3d> cotangents(mesh.node_count(), {1, 2, 3});
    SmoothOptions options{.method = Move{.derivative = Derivative::tangent}};
    options.quality_detail = QualityDetail::brief;
    const std::string name(element_name(type));
    const double slack = test::oracle::is_surface(type) ? 3 : 2;
    expect_bounded(name + ", tangent", mesh, options, slack,
                   {.prescribed = {nodes, std::span<const Vec3d>(tangents)}});
    options.method = Move{.derivative = Derivative::cotangent};
    options.boundary = BoundaryPolicy::free;
    expect_bounded(name + ", cotangent", mesh, options, slack,
                   {.prescribed = {nodes, {}}, .cotangent = std::span<const Vec3d>(cotangents)});
  }
}

TEST(Estimate, BoundsTheMemoryOfEveryElementType) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = large(type);
    const std::string name(element_name(type));
    for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}}) {
      expect_bounded(name, mesh, {.method = method, .max_iterations = 1});
      expect_bounded(name + " float32", test::as_float32(mesh),
                     {.method = method, .max_iterations = 1});
    }
  }
}

/// Poor elements are counted once more where nodes have gone back.
TEST(Estimate, BoundsTheMemoryOfCountingPoorElements) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::mapped(large(type), [](Vec3d p) {
      return Vec3d{p.x, 0.01 * p.y * p.y + p.y, 0.1 * p.z * p.z + 0.1 * p.z};
    });
    expect_bounded(std::string(element_name(type)), mesh,
                   {.method = Optimize{.goal = Goal::average, .target = Target::ideal},
                    .max_iterations = 2,
                    .report_below = 0.9},
                   test::oracle::is_surface(type) ? 3 : 2);
  }
}

TEST(Estimate, BoundsTheMemoryOfSecondOrder) {
  for (const ElementType type : kLinearTypes) {
    const bool surface = test::oracle::is_surface(type);
    const Mesh linear = test::noisy(test::lattice(type, surface                        ? 240
                                                        : type == ElementType::pyramid ? 29
                                                                                       : 37),
                                    0.1, 1);
    for (const bool full : {false, true}) {
      const Mesh mesh = test::second_order(linear, full);
      const SmoothOptions options{.method = SmartLaplacian{}, .max_iterations = 1};
      const std::unique_ptr<Smoother> smoother = make_smoother("cpu", 2);
      const std::int64_t estimate = smoother->estimate(test::size_of(mesh), options).host_bytes;
      Mesh corners = linear, result = mesh;
      const std::int64_t buffers = smoother->smooth(corners, options).host_peak_bytes;
      const std::int64_t before = bytes_now;
      bytes_peak = before;

      const std::int64_t told = smoother->smooth(result, options).host_peak_bytes;

      EXPECT_LE(buffers + bytes_peak - before, estimate) << element_name(type);
      EXPECT_LE(told, estimate) << element_name(type);
      EXPECT_LE(static_cast<double>(estimate), 1.2 * static_cast<double>(told))
          << element_name(type) << (full ? ", full" : "");
    }
  }
}

/// All inner nodes of second order beside the middle: everything is cured.
TEST(Estimate, BoundsTheMemoryOfACure) {
  for (const ElementType type : {ElementType::triangle, ElementType::tetrahedron}) {
    const Mesh linear = test::lattice(type, type == ElementType::triangle ? 150 : 22);
    Mesh mesh = test::noisy(test::second_order(linear), 0.3, 4);
    for (std::size_t n = 0; n < linear.node_count(); ++n) {
      test::points(mesh)[n] = test::points(linear)[n];
    }
    const SmoothOptions options{.method = Optimize{}, .max_iterations = 1};
    const std::unique_ptr<Smoother> smoother = make_smoother("cpu", 2);
    const std::int64_t estimate = smoother->estimate(test::size_of(mesh), options).host_bytes;
    Mesh corners = linear;
    const std::int64_t buffers = smoother->smooth(corners, options).host_peak_bytes;
    const std::int64_t before = bytes_now;
    bytes_peak = before;

    const std::int64_t told = smoother->smooth(mesh, options).host_peak_bytes;

    EXPECT_LE(bytes_peak - before, estimate) << element_name(type);
    EXPECT_LE(told, estimate) << element_name(type);
    EXPECT_GT(told, buffers) << element_name(type);
    EXPECT_LE(static_cast<double>(estimate), 1.2 * static_cast<double>(told)) << element_name(type);
    RecordProperty(std::string(element_name(type)),
                   std::to_string(bytes_peak - before) + " of " + std::to_string(estimate));
  }
}

TEST(Estimate, BoundsTheMemoryOfMixedAndCurvedMeshes) {
  for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}, Taubin{}}) {
    expect_bounded("mixed", test::mixed_stack(105), {.method = method, .max_iterations = 1});
    expect_bounded("sphere", test::sphere(7), {.method = method, .max_iterations = 1});
  }
}

TEST(Estimate, BoundsTheMemoryOfSlidingNodes) {
  for (const ElementType type : kLinearTypes) {
    Mesh mesh = large(type);
    const std::string name(element_name(type));
    mesh.regions.assign(mesh.element_count() / 2, 1);  // the lower half
    mesh.regions.resize(mesh.element_count(), 2);
    for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}, Optimize{}}) {
      const bool optimizes = std::holds_alternative<Optimize>(method);
      expect_bounded(name, optimizes ? test::wavy_if_surface(mesh) : mesh,
                     {.method = method, .max_iterations = 1, .boundary = BoundaryPolicy::slide},
                     1.3);  // the lattice of pyramids has few nodes on its boundary
    }
    const Mesh curved = test::mapped(test::wavy_if_surface(mesh), [](Vec3d p) {
      return Vec3d{p.x, p.y + std::sin(0.1 * p.x), p.z};
    });
    expect_bounded(name + " curved", curved,
                   {.method = Optimize{}, .max_iterations = 1, .boundary = BoundaryPolicy::slide},
                   1.3);
  }
}

/// Small and large surfaces; folded ones, all of whose edges are features.
TEST(Estimate, BoundsTheMemoryOfATargetSurface) {
  for (const ElementType type : {ElementType::hexahedron, ElementType::tetrahedron}) {
    const Mesh mesh = large(type);
    for (const int squares : {5, 60}) {
      for (const double fold : {0.0, 3.0}) {
        if (fold > 0 && squares < 60) continue;
        SurfaceMesh surface = test::box_surface(squares, {37, 37, 37});
        for (std::size_t n = 0; n < surface.points.size(); ++n) {
          surface.points[n] = (1 + 0.02 * fold * static_cast<double>(n % 2)) * surface.points[n];
        }
        const JobInput input{.surface = &surface};
        expect_bounded(std::string(element_name(type)) + ", " + std::to_string(squares) +
                           (fold > 0 ? ", folded" : ""),
                       mesh, {.max_iterations = 1, .boundary = BoundaryPolicy::slide}, 6, input);
      }
    }
  }
}

TEST(Estimate, BoundsTheMemoryOfOptimizeOnSurfaces) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    const std::string name(element_name(type));
    for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
      const SmoothOptions options{.max_iterations = 1, .boundary = boundary};
      expect_bounded(name + " curved", test::wavy_if_surface(large(type)), options, 1.3);
      expect_bounded(name + " plane", large(type), options, 3);
    }
  }
  expect_bounded("sphere", test::sphere(7), {.max_iterations = 1}, 1.3);
}

TEST(Estimate, BoundsTheMemoryOfRegionsUnderAFixedBoundary) {
  for (const ElementType type : kLinearTypes) {
    Mesh mesh = large(type);
    mesh.regions.assign(mesh.element_count() / 2, 1);
    mesh.regions.resize(mesh.element_count(), 2);
    expect_bounded(std::string(element_name(type)), mesh,
                   {.method = SmartLaplacian{}, .max_iterations = 1});
  }
}

TEST(Estimate, BoundsTheMemoryOfALongDescent) {
  for (const ElementType type : kLinearTypes) {
    const int n = test::oracle::is_surface(type) ? 225 : type == ElementType::pyramid ? 29 : 37;
    const Mesh mesh = test::long_error(type, n);
    const std::string name(element_name(type));
    expect_bounded(name, mesh, {.max_iterations = 20});
    expect_bounded(name + " float32", test::as_float32(mesh), {.max_iterations = 20});
  }
}

TEST(Estimate, BoundsTheMemoryOfTheQualityOfElements) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = large(type);
    const std::string name(element_name(type));
    for (const Method& method : std::vector<Method>{Laplacian{}, SmartLaplacian{}}) {
      SmoothOptions options = {.method = method, .max_iterations = 1};
      options.element_quality_metrics = {QualityMetric::mean_ratio};
      expect_bounded(name + ", one metric", mesh, options);
      options.element_quality_metrics.assign(kQualityMetrics.begin(), kQualityMetrics.end());
      expect_bounded(name + ", every metric", mesh, options);
      expect_bounded(name + ", every metric, float32", test::as_float32(mesh), options);
    }
  }
}

TEST(Estimate, HoldsWithoutIterations) {
  expect_bounded("evaluated only", large(ElementType::tetrahedron),
                 {.method = SmartLaplacian{}, .max_iterations = 0});
}

}  // namespace
}  // namespace meshsmooth

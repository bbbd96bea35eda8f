// Meshes that are written in ways of their own: on CUDA they have the bits of those that are not.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/canonical_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/surfaces.hpp"

namespace meshsmooth {
namespace {

using test::Job;

class CudaCanonical : public test::CudaTest {
 protected:
  Job on_cuda(const Mesh& mesh, const SmoothOptions& options) {
    if (smoother_ == nullptr) smoother_ = make_smoother("cuda:0");
    return test::smooth_on(*smoother_, mesh, options);
  }

 private:
  std::unique_ptr<Smoother> smoother_;
};

TEST_F(CudaCanonical, MirroredMeshesHaveTheBitsOfTheMeshNumberedAlike) {
  const std::vector<test::Way> ways = test::ways(false);
  const auto types = test::all_types();
  int mirrored_meshes = 0;
  for (unsigned seed = 0; seed < 1000; ++seed) {
    std::mt19937_64 random(seed);
    const ElementType type = types[seed % types.size()];
    const bool surface = element_shape(type).dimension == 2;
    const Mesh mesh = surface && seed % 2 == 0 && !is_second_order(type)
                          ? test::wavy_if_surface(test::lattice_of(type, 4))
                          : test::lattice_of(type, 3);
    const test::Way& way = ways[random() % ways.size()];
    if (way.form == Form::asynchronous) continue;
    const SmoothOptions options{.method = way.method, .form = way.form, .max_iterations = 4};
    Mesh other = mesh;
    const auto chosen = test::some_elements(mesh, random);
    mirror_elements(other.blocks, chosen);
    const auto mirrored = std::ranges::count(chosen, 1);
    if (surface && static_cast<std::size_t>(mirrored) == mesh.element_count()) continue;

    const Job expected = on_cuda(mesh, options);
    const Job found = on_cuda(other, options);

    EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh))
        << seed << " " << element_name(type) << " " << way.name;
    EXPECT_EQ(found.summary.quality_before.inverted_count, 0) << seed;
    if (surface && !std::holds_alternative<Optimize>(way.method)) continue;
    EXPECT_EQ(found.summary.quality_before.mirrored_count, mirrored) << seed;
    mirrored_meshes += mirrored > 0 ? 1 : 0;
  }
  EXPECT_GT(mirrored_meshes, 300);
}

TEST_F(CudaCanonical, BadlyTangledMeshesDoNotStartAnew) {
  Mesh mesh = test::badly_tangled(ElementType::tetrahedron, 30);
  EXPECT_EQ(test::count_starts(mesh, "cuda:0"), 1);
  mirror_elements(mesh.blocks, std::vector<std::uint8_t>(mesh.element_count(), 1));
  EXPECT_EQ(test::count_starts(mesh, "cuda:0"), 2);
}

TEST_F(CudaCanonical, CollapsedElementsAreSmoothedAsWhatTheyAre) {
  const Job expected = on_cuda(test::split_cube(false), {});
  const Job found = on_cuda(test::split_cube(true), {});
  EXPECT_TRUE(test::same_bits(expected.mesh, found.mesh));
  EXPECT_EQ(found.summary.quality_after.collapsed_count, 32);
}

TEST_F(CudaCanonical, InterfacesAndCracksStayTogether) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad, ElementType::tetrahedron,
                                 ElementType::hexahedron}) {
    for (const bool crack : {false, true}) {
      test::Cut cut = test::cut_lattice(type, false);
      if (crack) cut.mesh.blocks.erase(cut.mesh.blocks.begin());
      for (const BoundaryPolicy boundary : {BoundaryPolicy::fixed, BoundaryPolicy::slide}) {
        const Job job = on_cuda(cut.mesh, {.boundary = boundary});
        const auto& points = test::points(job.mesh);
        for (const auto& [a, b] : cut.pairs) {
          EXPECT_EQ(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)]);
        }
        EXPECT_EQ(job.summary.quality_after.interface_count, crack ? 0 : cut.interface_count);
        EXPECT_GT(job.summary.nodes.moved, 0);
      }
    }
  }
}

}  // namespace
}  // namespace meshsmooth

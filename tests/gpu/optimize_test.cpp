// What the goals of Optimize promise, on CUDA.

#include <gtest/gtest.h>

#include <cstdio>

#include "core/promises.hpp"
#include "generate/generate.hpp"
#include "gpu/gpu_meshes.hpp"
#include "support/cuda_device.hpp"
#include "support/far_errors.hpp"

namespace meshsmooth {
namespace {

/// With and without locked slivers, tangled and not.
std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> result = {
#if defined(MESHSMOOTH_WITH_TETGEN)
    {"cube of 3,000 nodes", formats::generate_cube(3'000, 2)},
    {"cube of 10,000", formats::generate_cube(10'000, 1)},
    {"cube of 10,000, other nodes", formats::generate_cube(10'000, 7)},
    {"cube of 10,000, tangled", formats::generate_cube(10'000, 1, 0.2)},
    {"cube of 30,000", formats::generate_cube(30'000, 3)},
    {"slope of 10,000", formats::generate_slope(10'000, 1)},
    {"ball of 3,000", formats::generate_ball(3'000, 5)},
    {"ball of 10,000", formats::generate_ball(10'000, 1)},
#endif
    {"pipe of 10,000", formats::generate_pipe(10'000, 1)},
    {"mixed, of 10,000", formats::generate_mixed(10'000, 1)},
    {"mixed, tangled", formats::generate_mixed(10'000, 1, 0.2)},
    {"square of 10,000", formats::generate_square(10'000, 1)},
    {"damaged cube", formats::generate_damage({}).mesh},
    {"hub", test::hub(24, 10, 0).mesh()}
  };
  for (const ElementType type : kLinearTypes) {
    const int cells = element_shape(type).dimension == 2 ? 40 : 12;
    for (const double size : {0.25, 0.45}) {
      result.emplace_back(
          std::string(element_name(type)) + " lattice, jitter " + std::to_string(size),
          test::noisy(test::lattice(type, cells), size, 6));
    }
  }
  return result;
}

class CudaOptimize : public test::CudaTest {};

TEST_F(CudaOptimize, LeavesTheWorstElementNoWorseThanBalanced) {
  const auto smoother = make_smoother("cuda:0");
  for (const auto& [name, mesh] : meshes()) {
    const auto [balanced, worst] = test::expect_worst_no_worse_than_balanced(*smoother, name, mesh);
    std::printf("%s on %s: least mean ratio %.4f balanced, %.4f worst; dihedral angle %.2f, %.2f\n",
                name.c_str(), std::string(smoother->backend()).c_str(), balanced.mean_ratio,
                worst.mean_ratio, balanced.dihedral_angle, worst.dihedral_angle);
  }
}

}  // namespace
}  // namespace meshsmooth

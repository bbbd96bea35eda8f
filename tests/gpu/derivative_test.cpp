// Derivatives of Move on CUDA: transposes of each other, and those of the CPU.

#include <gtest/gtest.h>

#include "support/cuda_device.hpp"
#include "support/derivatives.hpp"
#include "support/second_order.hpp"
#include "support/tilted.hpp"

namespace meshsmooth {
namespace {

using namespace test::derivatives;  // NOLINT(google-build-using-namespace)
using test::jittered_unit_lattice;

constexpr Where kCuda{"cuda:0"};

class CudaDerivative : public test::CudaTest {
 protected:
  static void expect_alike(const Case& of) {
    expect_transposes(of, kCuda);
    const Vectors u = random_vectors(of.nodes.size(), 1);
    const Vectors w = random_vectors(of.reference.node_count(), 2);
    const Vectors forward = tangent(of, u, kCuda).vectors;
    const Vectors reverse = cotangent(of, w, kCuda).vectors;
    EXPECT_LT(largest_difference(forward, tangent(of, u).vectors), 1e-10) << of.name;
    EXPECT_LT(largest_difference(reverse, cotangent(of, w).vectors), 1e-10) << of.name;
    EXPECT_EQ(tangent(of, u, kCuda).vectors, forward) << of.name;
    EXPECT_EQ(cotangent(of, w, kCuda).vectors, reverse) << of.name;
  }
};

TEST_F(CudaDerivative, IsThatOfTheCpuForEveryElement) {
  for (const ElementType type : kLinearTypes) {
    const std::string name(element_name(type));
    const Mesh linear = jittered_unit_lattice(type, 5);
    for (const Mesh& mesh : {linear, test::second_order(linear, true)}) {
      expect_alike(whole_boundary(name, mesh));
      expect_alike(one_side(name + ", sliding", mesh, BoundaryPolicy::slide));
      expect_alike(one_side(name + ", free", mesh, BoundaryPolicy::free));
    }
  }
}

TEST_F(CudaDerivative, IsThatOfTheCpuWhereNodesSlideObliquely) {
  Case of = one_side("tilted", jittered_unit_lattice(ElementType::tetrahedron, 16),
                     BoundaryPolicy::slide);
  of.reference = test::mapped(of.reference, test::tilted);
  expect_alike(of);
}

/// Against its own tangent: a sum over random vectors of so many nodes would nearly cancel.
TEST_F(CudaDerivative, HoldsOnLargeMeshes) {
  const Case of =
      one_side("cube", jittered_unit_lattice(ElementType::tetrahedron, 46), BoundaryPolicy::slide);
  const Vectors u = random_vectors(of.nodes.size(), 1);
  const Vectors forward = tangent(of, u, kCuda).vectors;
  const Vectors reverse = cotangent(of, forward, kCuda).vectors;
  const double expected = product(forward, forward);
  EXPECT_NEAR(product(u, at(of.nodes, reverse)), expected, 1e-12 * expected);
}

}  // namespace
}  // namespace meshsmooth

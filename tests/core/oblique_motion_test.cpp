// Move where nodes slide in planes that are oblique to the axes.

#include <gtest/gtest.h>

#include <cmath>

#include "core/smoothing.hpp"
#include "support/meshes.hpp"
#include "support/tilted.hpp"

namespace meshsmooth {
namespace {

using test::points;

/// The free nodes of a cube whose lower side is prescribed, where Laplace's equation puts them.
std::vector<Vec3d> predicted(const Mesh& mesh, const std::vector<NodeId>& nodes,
                             const std::vector<Vec3d>& to) {
  const SmoothOptions options{
      .method = Move{}, .max_iterations = 0, .boundary = BoundaryPolicy::slide};
  const test::Job job =
      test::smooth(mesh, options, {.prescribed = {nodes, std::span<const Vec3d>(to)}});
  EXPECT_EQ(job.summary.motion->reached, 1);
  return points(job.mesh);
}

TEST(ObliqueMotion, IsThatAlongTheAxes) {
  for (const ElementType type : {ElementType::tetrahedron, ElementType::hexahedron}) {
    const Mesh mesh = test::jittered_unit_lattice(type, 6);
    std::vector<NodeId> nodes;
    std::vector<Vec3d> to;
    for (std::size_t n = 0; n < mesh.node_count(); ++n) {
      const Vec3d p = points(mesh)[n];
      if (p.z > 1e-9) continue;
      nodes.push_back(static_cast<NodeId>(n));
      to.push_back(p + Vec3d{0.05 * p.y, -0.03 * p.x, 0.04 * std::sin(6 * p.x)});
    }
    const std::vector<Vec3d> straight = predicted(mesh, nodes, to);
    for (Vec3d& p : to) p = test::tilted(p);
    const std::vector<Vec3d> oblique = predicted(test::mapped(mesh, test::tilted), nodes, to);
    for (std::size_t n = 0; n < straight.size(); ++n) {
      EXPECT_LT(norm(oblique[n] - test::tilted(straight[n])), 2e-4);
    }
  }
}

}  // namespace
}  // namespace meshsmooth

// The phases of Optimize on the CUDA backend, each on topology from the oracle. A visit has no
// formula that is short and obvious, so it is compared with the CPU backend; its result on balls
// that one sees through, and the energy, are checked by hand and by the oracle.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/flatten.hpp"
#include "gpu/steps/host_steps.hpp"
#include "gpu/steps/step_meshes.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using test::FlatMesh;
using test::flatten;
using test::optimize_on_device;
using test::PhaseRequest;
using test::PhaseResult;

double largest_distance(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double largest = a.size() == b.size() ? 0 : HUGE_VAL;
  for (std::size_t n = 0; n < std::min(a.size(), b.size()); ++n) {
    largest = std::max(largest, norm(a[n] - b[n]));
  }
  return largest;
}

/// A team adds up a ball in another order, and may fuse multiplications and additions; in tangled
/// balls this grows to some 1e-10 of the mesh.
void expect_as_on_host(const FlatMesh& flat, const PhaseRequest& request, bool float32) {
  const PhaseResult expected = test::optimize_on_host(flat, float32, request);

  const PhaseResult found = optimize_on_device(flat, float32, request);

  const double near = float32 ? 1e-6 : 1e-9;
  EXPECT_LE(largest_distance(found.positions, expected.positions), near * flat.diagonal);
  EXPECT_EQ(found.sweeps, expected.sweeps);
  EXPECT_EQ(found.tangled, expected.tangled);
  EXPECT_EQ(found.invalid, expected.invalid);
  EXPECT_NEAR(found.gain, expected.gain, 1e3 * near);
  EXPECT_NEAR(found.weight, expected.weight, 1e-12 * expected.weight);
  EXPECT_NEAR(found.worst_mean_ratio, expected.worst_mean_ratio, 1e2 * near);
  if (expected.invalid == 0) {
    EXPECT_NEAR(found.energy / expected.energy, 1, 1e3 * near);
  }
}

class CudaOppositeNodes : public test::CudaTest {};

TEST_F(CudaOppositeNodes, AreTheOthersOfTheTetrahedronInTheOrderOfItsVolume) {
  for (const Mesh& mesh : {test::single(ElementType::tetrahedron), test::two_tets(),
                           test::tet_ball(), test::noisy(test::spokes(2), 0.02, 4),
                           test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 3)}) {
    const FlatMesh flat = flatten(mesh);

    const std::vector<NodeId> opposite = test::opposite_nodes_on_device(flat);

    ASSERT_EQ(opposite.size(), 3 * flat.ball_entries.size());
    for (std::size_t node = 0; node < flat.node_count(); ++node) {
      for (auto at = static_cast<std::size_t>(flat.ball_offsets[node]);
           at < static_cast<std::size_t>(flat.ball_offsets[node + 1]); ++at) {
        const NodeId* const element = &flat.runs[0].nodes[4 * std::size_t{flat.ball_entries[at]}];
        std::vector<NodeId> all = {static_cast<NodeId>(node), opposite[3 * at],
                                   opposite[3 * at + 1], opposite[3 * at + 2]};
        const auto edge = [&](std::size_t n) {
          return flat.positions[static_cast<std::size_t>(all[n])] - flat.positions[node];
        };
        EXPECT_GT(dot(cross(edge(1), edge(2)), edge(3)), 0);
        EXPECT_THAT(all, testing::UnorderedElementsAreArray(element, 4));
      }
    }
  }
}

class CudaOptimizePhase : public test::CudaTest {};

TEST_F(CudaOptimizePhase, BringsTheFreeNodeOfASymmetricBallToItsMiddle) {
  for (const Mesh& mesh :
       {test::tet_ball(), test::triangle_ring(), test::noisy(test::spokes(2), 0.02, 4)}) {
    const FlatMesh flat = flatten(mesh);

    const PhaseResult found = optimize_on_device(flat, false, {.sweeps = 30});

    EXPECT_LT(norm(flat.in_callers_order(found.positions).back()), 5e-3);
    EXPECT_EQ(found.tangled, 0);
  }
}

TEST_F(CudaOptimizePhase, UntanglesANodeThatLeftItsBall) {
  Mesh mesh = test::tet_ball();
  test::points(mesh)[6] = {1.4, 0.2, -0.3};
  const FlatMesh flat = flatten(mesh);

  const PhaseResult found =
      optimize_on_device(flat, false, {.power = 1, .guard = false, .sweeps = 30});

  EXPECT_EQ(found.tangled, 0);
  EXPECT_EQ(found.invalid, 0);
  EXPECT_LT(norm(flat.in_callers_order(found.positions)[6]), 0.1);
}

TEST_F(CudaOptimizePhase, DoesAsTheCpuDoesOnEveryElementType) {
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    for (const int power : {1, 2, 4}) {
      for (const bool float32 : {false, true}) {
        SCOPED_TRACE(name + ", power " + std::to_string(power) + (float32 ? ", float32" : ""));
        expect_as_on_host(flat, {.power = power, .sweeps = 3}, float32);
      }
    }
  }
}

TEST_F(CudaOptimizePhase, VisitsPoorBallsOnlyAsTheCpuDoes) {
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    SCOPED_TRACE(name);
    expect_as_on_host(flatten(mesh), {.power = 8, .poor = 1.25, .sweeps = 4}, false);
  }
}

TEST_F(CudaOptimizePhase, KeepsToTheMovementLimitAsTheCpuDoes) {
  constexpr double kLimit = 0.03;
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    SCOPED_TRACE(name);
    const FlatMesh flat = flatten(mesh);
    const PhaseRequest request{.sweeps = 4, .movement_limit = kLimit};
    expect_as_on_host(flat, request, false);

    const PhaseResult found = optimize_on_device(flat, false, request);

    EXPECT_LE(largest_distance(found.positions, flat.positions), kLimit * (1 + 1e-12));
  }
}

TEST_F(CudaOptimizePhase, UntanglesAsTheCpuDoes) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::noisy(test::lattice(type, 4), 0.45, 7);
    const FlatMesh flat = flatten(mesh);
    SCOPED_TRACE(element_name(type));
    // While a mesh is tangled roundings grow: one sweep.
    expect_as_on_host(flat, {.power = 1, .guard = false, .sweeps = 1}, false);
  }
}

TEST_F(CudaOptimizePhase, MeasuresTheEnergyOfTheOracle) {
  for (const ElementType type : {ElementType::triangle, ElementType::tetrahedron}) {
    const Mesh mesh = test::noisy(test::lattice(type, 4), 0.1, 3);
    const FlatMesh flat = flatten(mesh);
    for (const int power : {1, 2, 8}) {
      const PhaseResult found = optimize_on_device(flat, false, {.power = power, .sweeps = 1});

      Mesh after = mesh;
      test::points(after) = flat.in_callers_order(found.positions);
      const auto x = test::oracle::to_points(after);
      const std::vector<bool> held = test::oracle::held_nodes(mesh);
      double sum = 0, worst = HUGE_VAL;
      int count = 0;
      for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
        const bool all_held = std::all_of(e.nodes.begin(), e.nodes.end(), [&](NodeId n) {
          return held[static_cast<std::size_t>(n)];
        });
        if (all_held) continue;
        const double ratio = test::oracle::quality(type, test::oracle::corners(e, x)).mean_ratio;
        sum += std::pow(1 / ratio, power);
        worst = std::min(worst, ratio);
        ++count;
      }
      EXPECT_NEAR(found.energy / found.weight, sum / count, 1e-12 * sum / count);
      EXPECT_NEAR(found.worst_mean_ratio, worst, 1e-12);
      EXPECT_EQ(found.invalid, 0);
    }
  }
}

}  // namespace
}  // namespace meshsmooth

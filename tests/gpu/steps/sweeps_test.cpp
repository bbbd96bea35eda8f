// The sweep kernels of the CUDA backend, each on topology from the oracle.

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/flatten.hpp"
#include "gpu/steps/host_steps.hpp"
#include "gpu/steps/step_meshes.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using test::DeviceSweeps;
using test::FlatMesh;
using test::flatten;
using test::sweep_on_device;
using test::SweepKernel;
using test::oracle::Point;
using test::oracle::Points;
using test::oracle::Slow;

/// Exactly `count` sweeps.
SmoothOptions sweeps(int count, const Method& method, Form form) {
  SmoothOptions options;
  options.method = method;
  options.form = form;
  options.max_iterations = count;
  options.tolerance = {0, false};
  options.guard = false;
  return options;
}

Points in_callers_order(const FlatMesh& flat, const std::vector<Vec3d>& positions) {
  Points result;
  for (const Vec3d& p : flat.in_callers_order(positions)) {
    result.push_back(test::oracle::to_point(p));
  }
  return result;
}

double largest_move(const Points& before, const Points& after) {
  return test::oracle::max_distance(before, after);
}

/// What was moved is where the oracle says, what is fixed has its bits, and the figures of the
/// last sweep are those of the last step from `before_last` to `expected`.
void expect_sweeps(const DeviceSweeps& found, const FlatMesh& flat, const Points& before_last,
                   const Points& expected, int count, bool float32) {
  const double near = (float32 ? 1e-6 : 1e-13) * flat.diagonal;
  ASSERT_TRUE(found.ran);
  EXPECT_LE(test::oracle::max_distance(in_callers_order(flat, found.positions), expected), near);
  for (std::size_t n = 0; n < flat.node_count(); ++n) {
    if (flat.fixed[n] == 0) continue;
    const Vec3d given = float32 ? test::rounded_to_float32(flat.positions[n]) : flat.positions[n];
    EXPECT_EQ(found.positions[n], given) << "fixed node " << flat.caller_ids[n];
  }
  double squares = 0;
  for (std::size_t n = 0; n < expected.size(); ++n) {
    squares += (expected[n] - before_last[n]).squaredNorm();
  }
  const Convergence& convergence = found.convergence;
  EXPECT_EQ(convergence.iteration_count, count);
  EXPECT_NEAR(convergence.last_max_displacement, largest_move(before_last, expected), 2 * near);
  EXPECT_NEAR(convergence.last_rms_displacement,
              std::sqrt(squares / static_cast<double>(flat.free_count())), 2 * near);
}

constexpr Weighting kWeightings[] = {Weighting::uniform, Weighting::inverse_edge_length,
                                     Weighting::edge_length, Weighting::ball_volume};

/// Sweeps by Jacobi, by one kernel and by the oracle.
void expect_jacobi(SweepKernel kernel, Weighting weighting, bool float32) {
  constexpr double kRelaxation = 0.7;
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    for (const int count : {1, 2, 5}) {
      SCOPED_TRACE(name + ", " + std::to_string(count) + (float32 ? " float32" : " float64"));
      Points before, after = test::oracle::to_points(mesh);
      for (int sweep = 0; sweep < count; ++sweep) {
        before = after;
        after = slow.sweep(weighting, kRelaxation, before);
      }

      expect_sweeps(sweep_on_device(flat, kernel, float32,
                                    sweeps(count, Laplacian{weighting, kRelaxation}, Form::jacobi)),
                    flat, before, after, count, float32);
    }
  }
}

/// A kernel of many sweeps in one launch ends by itself after the first whose moves are below the
/// tolerance.
void expect_stop_at_tolerance(SweepKernel kernel, bool float32, Form form) {
  constexpr double kTolerance = 1e-3;
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 6), 0.2, 5);
  const FlatMesh flat = flatten(mesh);
  const Slow slow(mesh);
  const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
  Points before, after = test::oracle::to_points(mesh);
  int count = 0;
  do {
    before = after;
    after = form == Form::jacobi ? slow.sweep(Weighting::uniform, 1, before)
                                 : slow.sweep_in_place(Weighting::uniform, 1, order, before);
    ++count;
  } while (largest_move(before, after) >= kTolerance);
  ASSERT_GT(count, 5) << "the test's own mesh";
  SmoothOptions options = sweeps(1000, Laplacian{}, form);
  options.tolerance = {kTolerance, false};

  const DeviceSweeps found = sweep_on_device(flat, kernel, float32, options);

  expect_sweeps(found, flat, before, after, count, float32);
  EXPECT_EQ(found.stop_reason, StopReason::converged);
}

// --- in shared memory -------------------------------------------------------------

class CudaResidentSweeps : public test::CudaTest {};

TEST_F(CudaResidentSweeps, MoveNodesAsTheOracleDoes) {
  expect_jacobi(SweepKernel::resident, Weighting::uniform, true);
}

TEST_F(CudaResidentSweeps, EndAtTheTolerance) {
  expect_stop_at_tolerance(SweepKernel::resident, true, Form::jacobi);
}

TEST_F(CudaResidentSweeps, ExchangeTheHalosOfManyPatches) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::hexahedron, 12), 0.2, 6);
  const FlatMesh flat = flatten(mesh);
  const Slow slow(mesh);
  Points before, after = test::oracle::to_points(mesh);
  constexpr int kCount = 9;
  for (int sweep = 0; sweep < kCount; ++sweep) {
    before = after;
    after = slow.sweep(Weighting::uniform, 1, before);
  }

  expect_sweeps(
      sweep_on_device(flat, SweepKernel::resident, true, sweeps(kCount, Laplacian{}, Form::jacobi)),
      flat, before, after, kCount, true);
}

TEST_F(CudaResidentSweeps, LeaveAMeshAloneThatDoesNotFit) {
  const FlatMesh flat = flatten(test::noisy(test::spokes(5), 0.001, 4));  // a ring of 4098

  const DeviceSweeps found =
      sweep_on_device(flat, SweepKernel::resident, true, sweeps(3, Laplacian{}, Form::jacobi));

  EXPECT_FALSE(found.ran);
  EXPECT_EQ(found.positions, test::positions_as<double>(test::positions_as<float>(flat.positions)));
}

// --- in device memory -------------------------------------------------------------

class CudaJacobiSweeps : public test::CudaTest {};

TEST_F(CudaJacobiSweeps, MoveNodesAsTheOracleDoesInFloat64) {
  for (const Weighting weighting : kWeightings) {
    SCOPED_TRACE(static_cast<int>(weighting));
    expect_jacobi(SweepKernel::jacobi, weighting, false);
  }
}

TEST_F(CudaJacobiSweeps, MoveNodesAsTheOracleDoesInFloat32) {
  for (const Weighting weighting : kWeightings) {
    SCOPED_TRACE(static_cast<int>(weighting));
    expect_jacobi(SweepKernel::jacobi, weighting, true);
  }
}

TEST_F(CudaJacobiSweeps, EndAtTheTolerance) {
  expect_stop_at_tolerance(SweepKernel::jacobi, false, Form::jacobi);
}

TEST_F(CudaJacobiSweeps, KnowTheFreeNodeOfABallByHand) {
  const FlatMesh flat = flatten(test::tet_ball());

  const DeviceSweeps found =
      sweep_on_device(flat, SweepKernel::jacobi, false, sweeps(1, Laplacian{}, Form::jacobi));

  EXPECT_EQ(flat.in_callers_order(found.positions)[6], (Vec3d{0, 0, 0}));
}

class CudaSellSweeps : public test::CudaTest {};

/// The kernel declines rings of very different sizes.
TEST_F(CudaSellSweeps, MoveNodesAsTheOracleDoes) {
  int ran = 0;
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Points start = test::oracle::to_points(mesh);
    const Points once = Slow(mesh).sweep(Weighting::uniform, 1, start);
    const Points twice = Slow(mesh).sweep(Weighting::uniform, 1, once);
    for (const bool float32 : {false, true}) {
      SCOPED_TRACE(name + (float32 ? ", float32" : ", float64"));
      const DeviceSweeps found = sweep_on_device(flat, SweepKernel::jacobi_sell, float32,
                                                 sweeps(2, Laplacian{}, Form::jacobi));
      if (!found.ran) continue;
      ++ran;
      expect_sweeps(found, flat, once, twice, 2, float32);
    }
  }
  EXPECT_GE(ran, 12);
}

// --- colour by colour -------------------------------------------------------------

class CudaBallRecords : public test::CudaTest {};

TEST_F(CudaBallRecords, NameEveryFreeNodeOnceInItsColour) {
  auto meshes = test::sweep_meshes();
  // More nodes of a colour than a block sorts.
  meshes.emplace_back("many_blocks",
                      test::noisy(test::lattice(ElementType::hexahedron, 29), 0.1, 2));
  for (const auto& [name, mesh] : meshes) {
    const FlatMesh flat = flatten(mesh);

    const auto colours = test::ball_records_on_device(flat);

    ASSERT_EQ(colours.size() + 1, flat.colour_first.size()) << name;
    for (std::size_t c = 0; c < colours.size(); ++c) {
      std::vector<NodeId> nodes;
      for (const test::DeviceVisit& visit : colours[c]) {
        const auto n = static_cast<std::size_t>(visit.node);
        nodes.push_back(visit.node);
        ASSERT_EQ(visit.ball_begin, flat.ball_offsets[n]) << name;
        ASSERT_EQ(visit.ball_size, flat.ball_offsets[n + 1] - flat.ball_offsets[n]) << name;
      }
      std::sort(nodes.begin(), nodes.end());
      const auto begin = flat.colour_nodes.begin();
      EXPECT_TRUE(std::equal(nodes.begin(), nodes.end(),
                             begin + static_cast<std::ptrdiff_t>(flat.colour_first[c]),
                             begin + static_cast<std::ptrdiff_t>(flat.colour_first[c + 1])))
          << name << ", colour " << c;
    }
  }
}

/// By the number of threads that move a node.
class CudaColouredSweeps : public test::CudaTest, public testing::WithParamInterface<SweepKernel> {
 protected:
  [[nodiscard]] static std::vector<Weighting> weightings() {
    if (GetParam() == SweepKernel::coloured_16) return {Weighting::uniform};
    return {Weighting::uniform, Weighting::ball_volume};
  }
};
INSTANTIATE_TEST_SUITE_P(Teams, CudaColouredSweeps,
                         testing::Values(SweepKernel::coloured_8, SweepKernel::coloured_16,
                                         SweepKernel::coloured_32),
                         [](const auto& team) {
                           return team.param == SweepKernel::coloured_8    ? "Of8"
                                  : team.param == SweepKernel::coloured_16 ? "Of16"
                                                                           : "Of32";
                         });

TEST_P(CudaColouredSweeps, MoveNodesAsTheOracleDoes) {
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
    for (const Weighting weighting : weightings()) {
      const Points start = test::oracle::to_points(mesh);
      const Points once = slow.sweep_in_place(weighting, 0.8, order, start);
      const Points twice = slow.sweep_in_place(weighting, 0.8, order, once);
      for (const bool float32 : {false, true}) {
        SCOPED_TRACE(name + (float32 ? ", float32" : ", float64"));
        const SmoothOptions options = sweeps(2, Laplacian{weighting, 0.8}, Form::gauss_seidel);
        expect_sweeps(sweep_on_device(flat, GetParam(), float32, options), flat, once, twice, 2,
                      float32);
      }
    }
  }
}

TEST_P(CudaColouredSweeps, TakeOnlyMovesThatTheOracleFindsSmart) {
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
    for (const Weighting weighting : weightings()) {
      SCOPED_TRACE(name);
      const Points start = test::oracle::to_points(mesh);
      const Points once = slow.sweep_smart(weighting, 1, order, start);
      const Points twice = slow.sweep_smart(weighting, 1, order, once);
      const SmoothOptions options = sweeps(2, SmartLaplacian{weighting, 1}, Form::gauss_seidel);

      expect_sweeps(sweep_on_device(flat, GetParam(), false, options), flat, once, twice, 2, false);
    }
  }
}

TEST_P(CudaColouredSweeps, HoldWhatTheGuardHoldsOnTheCpu) {
  int held = 0;
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::horseshoe(type, element_shape(type).dimension == 2 ? 15 : 6);
    const FlatMesh flat = flatten(mesh);
    for (const bool smart : {false, true}) {
      SCOPED_TRACE(std::string(element_name(type)) + (smart ? ", smart" : ""));
      SmoothOptions options =
          sweeps(4, smart ? Method(SmartLaplacian{}) : Method(Laplacian{}), Form::gauss_seidel);
      options.guard = true;
      const DeviceSweeps expected = test::sweep_on_host<double>(flat, options);

      const DeviceSweeps found = sweep_on_device(flat, GetParam(), false, options);

      EXPECT_LE(largest_move(in_callers_order(flat, found.positions),
                             in_callers_order(flat, expected.positions)),
                1e-12 * flat.diagonal);
      EXPECT_EQ(found.convergence.held_node_count, expected.convergence.held_node_count);
      held += static_cast<int>(expected.convergence.held_node_count);
      // In float32 the last bits may take another trial; what was valid stays valid.
      const DeviceSweeps rounded = sweep_on_device(flat, GetParam(), true, options);
      Mesh after = mesh;
      test::points(after) = flat.in_callers_order(rounded.positions);
      EXPECT_EQ(measure_quality(after).inverted_count, 0);
    }
  }
  EXPECT_GT(held, 0) << "the guard had nothing to do";
}

TEST_P(CudaColouredSweeps, EndAtTheTolerance) {
  expect_stop_at_tolerance(GetParam(), false, Form::gauss_seidel);
}

// --- one sweep per call of the host -----------------------------------------------

class CudaSweepSteps : public test::CudaTest {};

TEST_F(CudaSweepSteps, MoveNodesAsTheOracleDoes) {
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    const auto order = test::oracle::colours(mesh, slow.held, detail::colour_priority);
    const Points start = test::oracle::to_points(mesh);
    for (const Form form : {Form::jacobi, Form::gauss_seidel}) {
      const auto swept = [&](const Points& x) {
        return form == Form::jacobi ? slow.sweep(Weighting::uniform, 1, x)
                                    : slow.sweep_in_place(Weighting::uniform, 1, order, x);
      };
      const Points once = swept(start), twice = swept(once);
      for (const bool float32 : {false, true}) {
        SCOPED_TRACE(name + (float32 ? ", float32" : ", float64"));
        expect_sweeps(
            sweep_on_device(flat, SweepKernel::step, float32, sweeps(2, Laplacian{}, form)), flat,
            once, twice, 2, float32);
      }
    }
  }
}

TEST_F(CudaSweepSteps, PushBackAsHcLaplacianDoes) {
  const HcLaplacian hc{.alpha = 0.2, .beta = 0.6};
  for (const auto& [name, mesh] : test::sweep_meshes()) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    const Points start = test::oracle::to_points(mesh);
    const Points once = slow.sweep_hc(hc, start, start);
    const Points twice = slow.sweep_hc(hc, start, once);
    for (const bool float32 : {false, true}) {
      SCOPED_TRACE(name + (float32 ? ", float32" : ", float64"));
      expect_sweeps(sweep_on_device(flat, SweepKernel::step, float32, sweeps(2, hc, Form::jacobi)),
                    flat, once, twice, 2, float32);
    }
  }
}

/// With one free node there is nothing to race with.
TEST_F(CudaSweepSteps, MoveASingleNodeAsynchronously) {
  for (const Mesh& mesh : {test::tet_ball(), test::triangle_ring(), test::spokes(1)}) {
    const FlatMesh flat = flatten(mesh);
    const Slow slow(mesh);
    const Points start = test::oracle::to_points(mesh);
    const Points half = slow.sweep(Weighting::uniform, 0.5, start);

    expect_sweeps(sweep_on_device(flat, SweepKernel::step, false,
                                  sweeps(1, Laplacian{.relaxation = 0.5}, Form::asynchronous)),
                  flat, start, half, 1, false);
  }
}

class CudaLimitMoves : public test::CudaTest {};

/// Nodes that moved together are cut back together: no formula node by node, so it is compared with
/// the CPU.
TEST_F(CudaLimitMoves, CutBackWhatTheCpuCutsBack) {
  int held = 0;
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::horseshoe(type, element_shape(type).dimension == 2 ? 15 : 6);
    const FlatMesh flat = flatten(mesh);
    for (const bool smart : {false, true}) {
      SCOPED_TRACE(std::string(element_name(type)) + (smart ? ", smart" : ""));
      SmoothOptions options =
          sweeps(4, smart ? Method(SmartLaplacian{}) : Method(Laplacian{}), Form::jacobi);
      options.guard = true;
      const DeviceSweeps expected = test::sweep_on_host<double>(flat, options);

      const DeviceSweeps found = sweep_on_device(flat, SweepKernel::step, false, options);

      EXPECT_LE(largest_move(in_callers_order(flat, found.positions),
                             in_callers_order(flat, expected.positions)),
                1e-12 * flat.diagonal);
      EXPECT_EQ(found.convergence.held_node_count, expected.convergence.held_node_count);
      held += static_cast<int>(expected.convergence.held_node_count);
      Mesh after = mesh;
      test::points(after) = flat.in_callers_order(found.positions);
      EXPECT_EQ(measure_quality(after).inverted_count, 0);
    }
  }
  EXPECT_GT(held, 0) << "the guard had nothing to do";
}

}  // namespace
}  // namespace meshsmooth

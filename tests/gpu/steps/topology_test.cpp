// The topology steps of the CUDA backend, in the order in which they run: where several of these
// suites fail, the first names the step.

#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/flatten.hpp"
#include "gpu/steps/step_meshes.hpp"
#include "meshsmooth/error.hpp"
#include "smooth/base/space_curve.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using test::as_lists;
using test::DeviceOrder;
using test::DeviceTopology;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

SmoothOptions with_balls() {
  SmoothOptions options;
  options.method = Laplacian{};
  options.guard = true;
  return options;
}
SmoothOptions without_balls() {
  SmoothOptions options = with_balls();
  options.form = Form::jacobi;
  options.guard = false;
  return options;
}

// --- order ------------------------------------------------------------------------

class CudaNodeOrder : public test::CudaTest {};

/// Along Hilbert's curve through a grid of a few times as many cells as nodes; ties keep the
/// caller's order.
std::vector<NodeId> order_along_curve(const std::vector<Vec3d>& positions, const DeviceOrder& box) {
  int bits = 2;
  while (bits < 10 && (std::size_t{1} << (3 * bits)) < 4 * positions.size()) ++bits;
  std::vector<std::uint64_t> keys;
  for (const Vec3d& p : positions) {
    keys.push_back(detail::hilbert_index(p, {box.lower, box.upper}, bits));
  }
  std::vector<NodeId> order(positions.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](NodeId a, NodeId b) {
    return keys[static_cast<std::size_t>(a)] < keys[static_cast<std::size_t>(b)];
  });
  return order;
}

TEST_F(CudaNodeOrder, FollowsTheCurveAndKeepsTheCallersOrderInACell) {
  for (const int side : {1, 3, 19, 20, 24}) {  // up to 8192 nodes are ordered by one block
    for (const bool float32 : {false, true}) {
      const Mesh exact = test::noisy(test::lattice(ElementType::hexahedron, side), 0.3, 1);
      const Mesh mesh = float32 ? test::as_float32(exact) : exact;
      const std::vector<Vec3d> given = test::points_as_double(mesh);

      const DeviceOrder found = test::order_nodes_on_device(mesh);

      EXPECT_EQ(found.lower, (Vec3d{0, 0, 0})) << side;
      EXPECT_EQ(found.upper, (Vec3d{double(side), double(side), double(side)})) << side;
      EXPECT_EQ(found.caller_ids, order_along_curve(given, found)) << side;
      for (std::size_t n = 0; n < given.size(); ++n) {
        const auto caller = static_cast<std::size_t>(found.caller_ids[n]);
        ASSERT_EQ(found.internal_of[caller], static_cast<NodeId>(n)) << side;
        ASSERT_EQ(found.positions[n], given[caller]) << side;
      }
      EXPECT_FALSE(found.wrong_position);
    }
  }
}

TEST_F(CudaNodeOrder, FindsTheBoxOfNegativeCoordinates) {
  const Mesh mesh = test::mapped(test::single(ElementType::tetrahedron), [](Vec3d p) {
    return p - Vec3d{3, 0.5, 7};
  });
  const DeviceOrder found = test::order_nodes_on_device(mesh);

  EXPECT_EQ(found.lower, (Vec3d{-3, -0.5, -7}));
  EXPECT_EQ(found.upper.x, -2);
}

TEST_F(CudaNodeOrder, ReportsAPositionThatIsNotFinite) {
  for (const int side : {3, 24}) {
    Mesh mesh = test::lattice(ElementType::hexahedron, side);
    test::points(mesh)[17].y = HUGE_VAL;

    EXPECT_TRUE(test::order_nodes_on_device(mesh).wrong_position) << side;
  }
}

// --- balls ------------------------------------------------------------------------

class CudaBalls : public test::CudaTest {};

TEST_F(CudaBalls, ListEachElementOnceInAscendingOrder) {
  for (const auto& [name, mesh] : test::topology_meshes()) {
    EXPECT_EQ(test::prepare_on_device(mesh, with_balls()).balls,
              as_lists(test::oracle::balls(mesh)))
        << name;
  }
}

TEST_F(CudaBalls, KnowTwoTetrahedraByHand) {
  const auto balls = test::prepare_on_device(test::two_tets(), with_balls()).balls;

  EXPECT_THAT(balls, ElementsAre(ElementsAre(0, 1), ElementsAre(0, 1), ElementsAre(0, 1),
                                 ElementsAre(0), ElementsAre(1)));
}

TEST_F(CudaBalls, AreNotKeptForAMethodThatNeedsNone) {
  EXPECT_THAT(test::prepare_on_device(test::tet_ball(), without_balls()).balls, IsEmpty());
}

// --- rings ------------------------------------------------------------------------

class CudaRings : public test::CudaTest {};

TEST_F(CudaRings, ListEachNeighbourOnceInAscendingOrder) {
  for (const auto& [name, mesh] : test::topology_meshes()) {
    const auto expected = as_lists(test::oracle::rings(mesh));

    EXPECT_EQ(test::prepare_on_device(mesh, with_balls()).rings, expected) << name;
    EXPECT_EQ(test::prepare_on_device(test::as_float32(mesh), without_balls()).rings, expected)
        << name << ", balls not kept";
  }
}

TEST_F(CudaRings, KnowTwoTetrahedraByHand) {
  const auto rings = test::prepare_on_device(test::two_tets(), with_balls()).rings;

  EXPECT_THAT(rings[0], ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(rings[3], ElementsAre(0, 1, 2));
  EXPECT_THAT(rings[4], ElementsAre(0, 1, 2));
}

// --- boundary ---------------------------------------------------------------------

class CudaBoundary : public test::CudaTest {};

TEST_F(CudaBoundary, FixesTheNodesOfFacetsUsedOnce) {
  for (const auto& [name, mesh] : test::topology_meshes()) {
    const std::vector<bool> held = test::oracle::held_nodes(mesh);

    const DeviceTopology found = test::prepare_on_device(mesh, with_balls());

    EXPECT_EQ(found.fixed, held) << name;
    EXPECT_EQ(found.nodes.boundary,
              static_cast<std::int64_t>(test::oracle::boundary_nodes(mesh).size()))
        << name;
    EXPECT_EQ(found.free_count,
              static_cast<std::size_t>(std::count(held.begin(), held.end(), false)))
        << name;
  }
}

TEST_F(CudaBoundary, KnowsSmallMeshesByHand) {
  const auto fixed = [](const Mesh& mesh) {
    return test::prepare_on_device(mesh, with_balls()).fixed;
  };

  EXPECT_THAT(fixed(test::tet_ball()), ElementsAre(true, true, true, true, true, true, false));
  EXPECT_THAT(fixed(test::open_cone(4)), ElementsAre(false, true, true, true, true));
  EXPECT_THAT(fixed(test::sphere(2)), testing::Each(false));
}

TEST_F(CudaBoundary, CountsWhatTheCallerFixesAndWhatIsIsolated) {
  const Mesh mesh = test::with_mask(
      test::with_isolated_node(test::noisy(test::lattice(ElementType::tetrahedron, 4), 0.1, 3)));
  for (const BoundaryPolicy policy : {BoundaryPolicy::fixed, BoundaryPolicy::free}) {
    SmoothOptions options = with_balls();
    options.boundary = policy;
    const std::vector<bool> held = test::oracle::held_nodes(mesh, policy == BoundaryPolicy::fixed);

    const DeviceTopology found = test::prepare_on_device(mesh, options);

    EXPECT_EQ(found.fixed, held);
    EXPECT_EQ(found.nodes.isolated, 1);
    EXPECT_EQ(found.nodes.boundary, 125 - 27);
    EXPECT_EQ(found.free_count,
              static_cast<std::size_t>(std::count(held.begin(), held.end(), false)));
  }
}

TEST_F(CudaBoundary, NamesTheFacetThatThreeElementsUse) {
  try {
    static_cast<void>(test::prepare_on_device(test::overused_facet(), with_balls()));
    ADD_FAILURE() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "FACET_OVERUSED");
    EXPECT_THAT(error.details(), Contains(Pair("facet_nodes", "0, 1, 2")));
  }
}

TEST_F(CudaBoundary, HoldsTheEdgesThatThreeSurfaceElementsUse) {
  for (const ElementType type : {ElementType::triangle, ElementType::quad}) {
    for (const int sheets : {3, 4, 40, 700}) {  // 700: more neighbours than short rows have
      Mesh mesh = test::make_mesh({{0, 0, 0}, {0, 0, 1}}, {{type, {}}});
      for (int s = 0; s < sheets; ++s) {
        const double angle = 6.28 * s / sheets;
        const auto first = static_cast<NodeId>(test::points(mesh).size());
        test::points(mesh).push_back({std::cos(angle), std::sin(angle), 0});
        test::points(mesh).push_back({std::cos(angle), std::sin(angle), 1});
        for (const NodeId node : {0, 1, first + 1}) mesh.blocks[0].nodes.push_back(node);
        if (type == ElementType::quad) mesh.blocks[0].nodes.push_back(first);
      }
      SmoothOptions options = with_balls();
      options.boundary = BoundaryPolicy::free;
      const DeviceTopology found = test::prepare_on_device(mesh, options);

      EXPECT_EQ(found.nodes.on_non_manifold_edges, 2);
      EXPECT_EQ(found.nodes.boundary, (type == ElementType::quad ? 2 : 1) * sheets);
      EXPECT_TRUE(found.fixed[0]);
      EXPECT_TRUE(found.fixed[1]);
      EXPECT_FALSE(found.fixed[3]);
    }
  }
}

// --- colours ----------------------------------------------------------------------

class CudaColouring : public test::CudaTest {};

std::vector<std::vector<NodeId>> colours_of(const test::FlatMesh& flat) {
  std::vector<std::vector<NodeId>> colours;
  for (std::size_t c = 0; c + 1 < flat.colour_first.size(); ++c) {
    const auto at = [&](std::size_t n) {
      return flat.colour_nodes.begin() + static_cast<std::ptrdiff_t>(n);
    };
    colours.emplace_back(at(flat.colour_first[c]), at(flat.colour_first[c + 1]));
  }
  return colours;
}

TEST_F(CudaColouring, IsFirstFitInTheOrderOfPriority) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    for (const bool boundary_fixed : {true, false}) {
      const test::FlatMesh flat = test::flatten(mesh, boundary_fixed);
      if (flat.free_count() == 0) continue;  // nobody asks

      EXPECT_EQ(test::colour_on_device(flat), colours_of(flat)) << name;
    }
  }
}

TEST_F(CudaColouring, KnowsRingsOfMoreThan64Nodes) {
  for (const int levels : {2, 3}) {
    const test::FlatMesh flat = test::flatten(test::spokes(levels), false);

    EXPECT_EQ(test::colour_on_device(flat), colours_of(flat)) << levels;
  }
}

}  // namespace
}  // namespace meshsmooth

#include <gmock/gmock.h>

#include "core/steps.hpp"

namespace meshsmooth {
namespace {

using test::as_lists;
using test::Steps;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(FindNeighbours, ListsEachNeighbourOnceInAscendingOrder) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    EXPECT_EQ(Steps(mesh).rings(), as_lists(test::oracle::rings(mesh))) << name;
  }
}

TEST(FindNeighbours, BySortingListsTheSame) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    EXPECT_EQ(Steps(mesh).rings_by_sorting(), as_lists(test::oracle::rings(mesh))) << name;
  }
}

TEST(FindNeighbours, KnowsTwoTetrahedraByHand) {
  const auto rings = Steps(test::two_tets()).rings();

  EXPECT_THAT(rings[0], ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(rings[3], ElementsAre(0, 1, 2));
  EXPECT_THAT(rings[4], ElementsAre(0, 1, 2));
}

TEST(FindNeighbours, GivesAnIsolatedNodeAnEmptyRow) {
  Steps steps(test::with_isolated_node(test::two_tets()));

  EXPECT_THAT(steps.rings()[5], IsEmpty());
  EXPECT_THAT(steps.rings_by_sorting()[5], IsEmpty());
  EXPECT_THAT(steps.balls()[5], IsEmpty());
}

TEST(FindNeighbours, IsTheSameForEveryNumberOfThreads) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 17), 0.1, 2);
  const auto expected = Steps(mesh, 1).rings();

  EXPECT_EQ(Steps(mesh, 2).rings(), expected);
  EXPECT_EQ(Steps(mesh, 5).rings(), expected);
}

TEST(FindNeighbours, SortsARowThatIsLongerThanUsual) {
  const Mesh fan = test::open_cone(3000);

  EXPECT_EQ(Steps(fan).rings(), as_lists(test::oracle::rings(fan)));
  EXPECT_EQ(Steps(fan).balls(), as_lists(test::oracle::balls(fan)));
}

TEST(FindBalls, ListsEachElementOnceInAscendingOrder) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    EXPECT_EQ(Steps(mesh).balls(), as_lists(test::oracle::balls(mesh))) << name;
  }
}

TEST(FindBalls, KeepsTheCallersIdsThroughScatteredBlocks) {
  Mesh mesh = test::noisy(test::lattice(ElementType::hexahedron, 3), 0.1, 1);
  const std::vector<NodeId> all = mesh.blocks[0].nodes;
  mesh.blocks.clear();
  for (std::size_t e = 0; e < 27; e += 9) {
    mesh.blocks.push_back({ElementType::hexahedron,
                           {all.begin() + static_cast<std::ptrdiff_t>(8 * e),
                            all.begin() + static_cast<std::ptrdiff_t>(8 * (e + 9))}});
    mesh.blocks.push_back({ElementType::wedge, {}});
  }

  EXPECT_EQ(Steps(mesh).balls(), as_lists(test::oracle::balls(mesh)));
}

TEST(RenumberNodes, IsAPermutationThatKeepsNeighboursClose) {
  const Mesh mesh = test::lattice(ElementType::hexahedron, 15);
  std::vector<NodeId> order = Steps(mesh).caller_ids_of_nodes();
  double apart = 0;
  for (std::size_t n = 1; n < order.size(); ++n) {
    apart += norm(test::points(mesh)[order[n]] - test::points(mesh)[order[n - 1]]);
  }

  EXPECT_LT(apart / static_cast<double>(order.size()), 1.2);  // a Hilbert curve: 1
  std::sort(order.begin(), order.end());
  for (std::size_t n = 0; n < order.size(); ++n) ASSERT_EQ(order[n], static_cast<NodeId>(n));
}

}  // namespace
}  // namespace meshsmooth

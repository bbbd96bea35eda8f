#include <gmock/gmock.h>

#include "core/chain.hpp"
#include "core/steps.hpp"

namespace meshsmooth {
namespace {

using test::Steps;
using test::oracle::held_nodes;

TEST(ColourNodes, IsFirstFitInTheOrderOfPriority) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    const std::vector<bool> held = held_nodes(mesh);
    auto expected = test::oracle::colours(mesh, held, detail::colour_priority);
    for (auto& colour : expected) std::sort(colour.begin(), colour.end());

    EXPECT_EQ(Steps(mesh).colours(held), expected) << name;
  }
}

// After some rounds a serial pass goes on.
TEST(ColourNodes, IsFirstFitForIdsThatMakeEachNodeWaitForTheOneBefore) {
  const Mesh mesh = test::chain(317);
  const std::vector<bool> held(mesh.node_count());
  auto expected = test::oracle::colours(mesh, held, detail::colour_priority);
  for (auto& colour : expected) std::sort(colour.begin(), colour.end());

  EXPECT_EQ(Steps(mesh).colours(held), expected);
}

TEST(ColourNodes, GivesNodesOfOneElementDifferentColours) {
  for (const auto& [name, mesh] : test::step_meshes()) {
    std::map<NodeId, std::size_t> colour_of;
    const auto colours = Steps(mesh).colours(std::vector<bool>(mesh.node_count()));
    for (std::size_t c = 0; c < colours.size(); ++c) {
      for (const NodeId n : colours[c]) EXPECT_TRUE(colour_of.emplace(n, c).second) << name;
    }

    EXPECT_EQ(colour_of.size(), mesh.node_count()) << name;
    for (const test::oracle::Element& e : test::oracle::elements(mesh)) {
      std::set<std::size_t> seen;
      for (const NodeId n : e.nodes) seen.insert(colour_of[n]);
      EXPECT_EQ(seen.size(), e.nodes.size()) << name;
    }
  }
}

TEST(ColourNodes, IsTheSameForEveryNumberOfThreads) {
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 17), 0.1, 2);
  const std::vector<bool> held = held_nodes(mesh);
  const auto expected = Steps(mesh, 1).colours(held);

  EXPECT_EQ(Steps(mesh, 2).colours(held), expected);
  EXPECT_EQ(Steps(mesh, 5).colours(held), expected);
}

TEST(ColourNodes, NeedsNoColourWithoutFreeNodes) {
  EXPECT_TRUE(Steps(test::two_tets()).colours(std::vector<bool>(5, true)).empty());
}

}  // namespace
}  // namespace meshsmooth

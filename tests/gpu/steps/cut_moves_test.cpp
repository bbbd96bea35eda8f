// Cuts of moves over more rounds than a word has bits, and the barrier that ends each round.

#include <gmock/gmock.h>

#include <algorithm>
#include <random>
#include <set>

#include "gpu/steps/cuda_steps.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

constexpr int kMostCuts = 4;  // then a move is undone

class CutMoves : public test::CudaTest {};

TEST_F(CutMoves, AreCountedOverManyRounds) {
  std::mt19937_64 random(1);
  for (const std::size_t node_count : {std::size_t{1}, std::size_t{1000}, std::size_t{50'000}}) {
    SCOPED_TRACE(node_count);
    std::vector<std::vector<NodeId>> demands(90);
    std::vector<int> expected(node_count);
    for (std::size_t round = 0; round < demands.size(); ++round) {
      // Some rounds demand nothing, some of one node alone: of one block.
      const std::size_t count = round % 5 == 0 ? 0 : round % 5 == 1 ? 1 : node_count / 30 + 1;
      std::set<NodeId> nodes;
      for (std::size_t n = 0; n < count; ++n)
        nodes.insert(static_cast<NodeId>(random() % node_count));
      demands[round].assign(nodes.begin(), nodes.end());
      for (const NodeId node : nodes) ++expected[static_cast<std::size_t>(node)];
    }

    const test::DeviceCuts found = test::cut_on_device(node_count, demands);

    for (std::size_t node = 0; node < node_count; ++node) {
      ASSERT_EQ(std::min(found.cuts[node], kMostCuts), std::min(expected[node], kMostCuts)) << node;
      ASSERT_TRUE(found.consistent[node]) << node;
    }
    for (std::size_t round = 0; round < demands.size(); ++round) {
      EXPECT_THAT(found.broken[round], testing::Each(!demands[round].empty())) << round;
    }
  }
}

}  // namespace
}  // namespace meshsmooth

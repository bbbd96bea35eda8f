#include <string>

#include "meshsmooth/error.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth {
namespace {

// Of one node.
constexpr std::uint8_t kFixed = 1, kPrescribed = 2, kPaired = 4;

[[noreturn]] void refuse_pair(const char* reason, std::size_t pair, NodeId node,
                              const std::string& what) {
  throw InvalidMesh(
      reason, "node pair " + std::to_string(pair) + ": node " + std::to_string(node) + " " + what,
      {{"node", std::to_string(node)}});
}

}  // namespace

HeldPairs hold_node_pairs(const TopologyView& topology, const JobInput& input) {
  validate_sizes(topology);
  HeldPairs held;
  std::vector<std::uint8_t>& marks = held.fixed;
  marks.resize(topology.node_count, 0);
  for (std::size_t node = 0; node < topology.fixed.size(); ++node) {
    if (topology.fixed[node] != 0) marks[node] = kFixed;
  }
  const auto is_node = [&](NodeId node) {
    return node >= 0 && static_cast<std::size_t>(node) < topology.node_count;
  };
  for (const NodeId node : input.prescribed.nodes) {  // `validate_prescribed` refuses others
    if (is_node(node)) marks[static_cast<std::size_t>(node)] |= kPrescribed;
  }
  for (std::size_t pair = 0; pair < input.node_pairs.size(); ++pair) {
    for (const NodeId node : input.node_pairs[pair]) {
      if (is_node(node)) continue;
      refuse_pair(
          "INDEX_OUT_OF_RANGE", pair, node,
          "is out of range, the mesh has " + std::to_string(topology.node_count) + " nodes");
    }
    const auto [a, b] = input.node_pairs[pair];
    std::uint8_t& mark_a = marks[static_cast<std::size_t>(a)];
    std::uint8_t& mark_b = marks[static_cast<std::size_t>(b)];
    if (((mark_a ^ mark_b) & kPrescribed) != 0) {
      const bool a_prescribed = (mark_a & kPrescribed) != 0;
      refuse_pair("PAIR_HALF_PRESCRIBED", pair, a_prescribed ? a : b,
                  "is prescribed, but its partner, node " + std::to_string(a_prescribed ? b : a) +
                      ", is not; prescribe both or none, or ignore the pairs that the file names "
                      "(--file-pairs off, file_pairs=False)");
    }
    mark_a |= kPaired;
    mark_b |= kPaired;
  }
  for (std::uint8_t& mark : marks) {
    const bool by_pair = (mark & kPaired) != 0 && (mark & kPrescribed) == 0;
    held.paired += by_pair ? 1 : 0;
    mark = by_pair || (mark & kFixed) != 0 ? 1 : 0;
  }
  return held;
}

}  // namespace meshsmooth

// The file of --fixed-nodes. First byte: how many nodes the mesh has.
#include <sstream>

#include "fixed_nodes.hpp"
#include "fuzz/choices.hpp"
#include "meshsmooth/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  testing::Choices choices({data, size});
  const std::size_t node_count = choices.byte();
  std::istringstream stream(choices.rest());
  try {
    const std::vector<NodeId> nodes = cli::read_fixed_nodes(stream, "a file", node_count);
    std::vector<std::uint8_t> mask;
    cli::mark_fixed(mask, nodes, node_count);
    for (const NodeId node : nodes) {
      testing::require(mask.at(static_cast<std::size_t>(node)) == 1, "a listed node is marked");
    }
  } catch (const InvalidOption& error) {
    testing::require(error.reason() == "FIXED_NODES_INVALID", error.reason());
  }
  return 0;
}

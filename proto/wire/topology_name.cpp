#include "wire/topology_name.hpp"

#include <cstdint>

#include "wire/codec.hpp"

namespace meshsmooth::wire {

TopologyNamer::TopologyNamer(const MeshLayout& layout) {
  const auto add_number = [this](std::int64_t number) {
    hash_.add(std::as_bytes(std::span(&number, 1)));
  };
  add_number(layout.node_count);
  add_number(static_cast<std::int64_t>(layout.blocks.size()));
  for (const MeshLayout::Block& block : layout.blocks) {
    add_number(encode_element_type(block.type));
    add_number(block.element_count);
  }
  add_number(layout.fixed_mask_bytes > 0 ? 1 : 0);
  add_number(layout.element_regions_bytes > 0 ? 1 : 0);
  if (layout.kept_reference_float64) {
    add_number(*layout.kept_reference_float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32);
  }
}

std::string topology_name(const TopologyView& topology, const PositionsView& reference) {
  MeshLayout layout;
  layout.node_count = static_cast<std::int64_t>(topology.node_count);
  for (const ElementBlockView& block : topology.blocks) {
    layout.blocks.push_back({block.type, static_cast<std::int64_t>(block.element_count())});
  }
  layout.fixed_mask_bytes = static_cast<std::int64_t>(topology.fixed.size_bytes());
  layout.element_regions_bytes = static_cast<std::int64_t>(topology.regions.size_bytes());
  if (position_count(reference) > 0) {
    layout.kept_reference_float64 = encode_position_type(reference) == v1::SCALAR_TYPE_FLOAT64;
  }
  TopologyNamer namer(layout);
  for (const ElementBlockView& block : topology.blocks) namer.add(std::as_bytes(block.nodes));
  namer.add(std::as_bytes(topology.fixed));
  namer.add(std::as_bytes(topology.regions));
  std::visit([&](const auto& positions) { namer.add(std::as_bytes(positions)); }, reference);
  return namer.finish();
}

}  // namespace meshsmooth::wire

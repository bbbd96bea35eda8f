#include "smooth/second_order/repaired_part.hpp"

#include <algorithm>
#include <atomic>
#include <bit>

#include "mesh/boundary_nodes.hpp"
#include "smooth/second_order/shares.hpp"

namespace meshsmooth::detail {
namespace {

std::vector<std::uint8_t> elements_touching(const TopologyView& topology,
                                            const std::vector<std::uint8_t>& chosen) {
  std::vector<std::uint8_t> touching(topology.element_count());
  for_each_element(topology, [&](ElementType, std::span<const NodeId> nodes, std::size_t element) {
    touching[element] = std::ranges::any_of(
        nodes, [&](NodeId node) { return chosen[static_cast<std::size_t>(node)] != 0; });
  });
  return touching;
}

void add_ring(const TopologyView& topology, std::vector<std::uint8_t>& chosen) {
  const std::vector<std::uint8_t> touching = elements_touching(topology, chosen);
  for_each_element(topology, [&](ElementType, std::span<const NodeId> nodes, std::size_t element) {
    if (touching[element] != 0) mark_nodes(nodes, chosen);
  });
}

}  // namespace

void mark_nodes(std::span<const NodeId> nodes, std::vector<std::uint8_t>& marks) {
  for (const NodeId node : nodes) {
    std::atomic_ref(marks[static_cast<std::size_t>(node)]).store(1, std::memory_order_relaxed);
  }
}

void RepairedPart::Size::add(ElementType type, std::int64_t count) {
  part_elements += count;
  entries += count * static_cast<std::int64_t>(element_width(type));
  facets += count * element_shape(type).facet_count;
}

// The boundary is found first, then the part is kept; lists that grow have up to twice their size.
std::int64_t RepairedPart::Size::bytes() const {
  const std::int64_t boundary =
      boundary_nodes_bytes(nodes, facets) + 4 * entries + 4 * part_elements;
  const std::int64_t part = nodes * (4 + 4 + 8 + 2 * 8 + 2 * 8) + elements + 8 * entries +
                            part_elements * (static_cast<std::int64_t>(sizeof(PartElement)) + 8);
  return 3 * nodes + elements + std::max(boundary, part);
}

RepairedPart::RepairedPart(const TopologyView& topology, const SurfaceOrientation& orientation,
                           std::vector<std::uint8_t> chosen, int rings,
                           std::span<const std::uint8_t> held)
    : size_{.nodes = static_cast<std::int64_t>(topology.node_count),
            .elements = static_cast<std::int64_t>(topology.element_count())} {
  for (int ring = 0; ring < rings; ++ring) add_ring(topology, chosen);
  const std::vector<std::uint8_t> touched = elements_touching(topology, chosen);
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    if (held[n] != 0) chosen[n] = 0;
  }
  for (const NodeId node : boundary_of(topology, touched)) {
    chosen[static_cast<std::size_t>(node)] = 0;
  }
  nodes_.reserve(static_cast<std::size_t>(std::ranges::count(chosen, 1)));
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    if (chosen[n] != 0) nodes_.push_back(static_cast<NodeId>(n));
  }
  const std::vector<std::uint8_t> moves = elements_touching(topology, chosen);
  part_elements_.reserve(static_cast<std::size_t>(std::ranges::count(moves, 1)));
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      if (moves[element] == 0) continue;
      part_elements_.push_back(
          {block.type, block.nodes.subspan(at, width), orientation.reference(element)});
    }
  }
  list_elements(topology.node_count);
  colour();
}

/// Of some elements: a facet that others share too has no node that they do not all touch.
std::vector<NodeId> RepairedPart::boundary_of(const TopologyView& topology,
                                              const std::vector<std::uint8_t>& elements) {
  std::vector<ElementBlock> blocks;
  std::vector<std::int32_t> regions;
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    std::vector<NodeId>& nodes = blocks.emplace_back(ElementBlock{block.type, {}}).nodes;
    const auto count =
        std::ranges::count(std::span(elements).subspan(element, block.element_count()), 1);
    nodes.reserve(static_cast<std::size_t>(count) * width);
    size_.add(block.type, count);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      if (elements[element] == 0) continue;
      const std::span own = block.nodes.subspan(at, width);
      nodes.insert(nodes.end(), own.begin(), own.end());
      if (!topology.regions.empty()) regions.push_back(topology.regions[element]);
    }
  }
  std::vector<ElementBlockView> views;
  for (const ElementBlock& block : blocks) views.push_back({block.type, block.nodes});
  return find_boundary_nodes({topology.node_count, views, {}, regions}, true);
}

void RepairedPart::list_elements(std::size_t node_count) {
  std::vector<std::int32_t> index(node_count, -1);
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    index[static_cast<std::size_t>(nodes_[n])] = static_cast<std::int32_t>(n);
  }
  const auto visit_entries = [&](const auto& visit) {
    for (std::size_t p = 0; p < part_elements_.size(); ++p) {
      for (const NodeId node : part_elements_[p].nodes) {
        const std::int32_t n = index[static_cast<std::size_t>(node)];
        if (n >= 0) visit(static_cast<std::size_t>(n), p);
      }
    }
  };
  first_element_.assign(nodes_.size() + 2, 0);
  visit_entries([&](std::size_t n, std::size_t) { ++first_element_[n + 2]; });
  for (std::size_t n = 2; n < first_element_.size(); ++n) {
    first_element_[n] += first_element_[n - 1];
  }
  elements_.resize(first_element_.back());
  visit_entries([&](std::size_t n, std::size_t p) { elements_[first_element_[n + 1]++] = p; });
}

/// First fit, in ascending order: nodes of one colour share no element.
void RepairedPart::colour() {
  std::vector<std::uint64_t> used(
      part_elements_.size());  // colours at an element, at most 27 nodes
  std::vector<std::size_t> others;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    std::uint64_t taken = 0;
    for (const std::size_t p : elements_at(n)) taken |= used[p];
    const std::uint64_t bit = ~taken & (taken + 1);
    if (bit == 0) {
      others.push_back(n);  // each in a colour of its own
      continue;
    }
    for (const std::size_t p : elements_at(n)) used[p] |= bit;
    const auto colour = static_cast<std::size_t>(std::countr_zero(bit));
    if (colour >= colours_.size()) colours_.resize(colour + 1);
    colours_[colour].push_back(n);
  }
  for (const std::size_t n : others) colours_.push_back({n});
}

}  // namespace meshsmooth::detail

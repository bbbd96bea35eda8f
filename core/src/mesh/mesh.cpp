#include "meshsmooth/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "mesh/parallel.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// The lowest index below `count` that is `wrong`, or kNone.
template <class Wrong>
std::size_t find_first(std::size_t count, const Wrong& wrong) {
  return detail::parallel_reduce(
      count, kNone, [&](std::size_t i) { return wrong(i) ? i : kNone; },
      [](std::size_t a, std::size_t b) { return std::min(a, b); });
}

[[noreturn]] void throw_size(const std::string& message) {
  throw InvalidMesh("ARRAY_SIZE_MISMATCH", message);
}

}  // namespace

void validate_sizes(const TopologyView& topology) {
  if (topology.node_count == 0) throw InvalidMesh("MESH_EMPTY", "the mesh has no nodes");
  if (topology.element_count() == 0) throw InvalidMesh("MESH_EMPTY", "the mesh has no elements");
  if (topology.node_count > std::numeric_limits<NodeId>::max()) {
    throw_size("the mesh has " + std::to_string(topology.node_count) +
               " nodes, node ids are 32-bit");
  }
  if (!topology.fixed.empty() && topology.fixed.size() != topology.node_count) {
    throw_size("the fixed mask has " + std::to_string(topology.fixed.size()) +
               " bytes, the mesh has " + std::to_string(topology.node_count) + " nodes");
  }
  if (!topology.regions.empty() && topology.regions.size() != topology.element_count()) {
    throw_size("the mesh has regions for " + std::to_string(topology.regions.size()) +
               " elements, but " + std::to_string(topology.element_count()) + " elements");
  }
  const ElementType first = topology.blocks.front().type;
  for (std::size_t b = 0; b < topology.blocks.size(); ++b) {
    const ElementBlockView& block = topology.blocks[b];
    const std::string name(element_name(block.type));
    if (block.nodes.size() % element_width(block.type) != 0) {
      throw_size("block " + std::to_string(b) + " (" + name + ") has " +
                 std::to_string(block.nodes.size()) + " nodes, that is no multiple of " +
                 std::to_string(element_width(block.type)));
    }
    const std::string blocks = "block " + std::to_string(b) + " (" + name + ") and block 0 (" +
                               std::string(element_name(first)) + ") are of different ";
    if (element_shape(block.type).dimension != element_shape(first).dimension) {
      throw InvalidMesh("MIXED_DIMENSIONS",
                        blocks + "dimension; send surface and volume elements as separate meshes");
    }
    if (is_second_order(block.type) != is_second_order(first)) {
      throw InvalidMesh("MIXED_ORDERS",
                        blocks +
                            "order; the elements of a mesh are all linear or all of second "
                            "order");
    }
  }
}

namespace {

/// Local number of the first node of the element that is out of range or
/// repeats an earlier one, or -1.
int find_wrong_node(const NodeId* nodes, int count, std::size_t node_count) {
  for (int n = 0; n < count; ++n) {
    if (nodes[n] < 0 || static_cast<std::size_t>(nodes[n]) >= node_count) return n;
  }
  for (int n = 1; n < count; ++n) {
    for (int earlier = 0; earlier < n; ++earlier) {
      if (nodes[earlier] == nodes[n]) return n;
    }
  }
  return -1;
}

/// How errors name a node of an element.
struct NodeInElement {
  NodeInElement(std::size_t element, ElementType type, NodeId node)
      : text("element " + std::to_string(element) + " (" + std::string(element_name(type)) +
             "): node " + std::to_string(node)),
        details{{"element", std::to_string(element)}, {"node", std::to_string(node)}} {}
  std::string text;
  ErrorDetails details;
};

void validate_elements(const ElementBlockView& block, std::size_t first_id,
                       std::size_t node_count) {
  const auto width = static_cast<int>(element_width(block.type));
  const auto nodes_of = [&](std::size_t e) {
    return block.nodes.data() + e * static_cast<std::size_t>(width);
  };
  const std::size_t wrong = find_first(block.element_count(), [&](std::size_t e) {
    return find_wrong_node(nodes_of(e), width, node_count) >= 0;
  });
  if (wrong == kNone) return;

  const NodeId* const nodes = nodes_of(wrong);
  const NodeId node = nodes[find_wrong_node(nodes, width, node_count)];
  const NodeInElement at(first_id + wrong, block.type, node);
  if (node < 0 || static_cast<std::size_t>(node) >= node_count) {
    throw InvalidMesh("INDEX_OUT_OF_RANGE",
                      at.text + " is out of range, the mesh has " + std::to_string(node_count) +
                          " nodes" + (node < 0 ? " and they count from 0" : ""),
                      at.details);
  }
  throw_repeated_node(first_id + wrong, block.type, {nodes, static_cast<std::size_t>(width)});
}

template <class Real>
void validate_finite(std::span<const Vec3<Real>> positions, const std::string& of = "") {
  const std::size_t wrong = find_first(positions.size(), [&](std::size_t node) {
    const Vec3<Real> p = positions[node];
    return !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  });
  if (wrong == kNone) return;
  const Vec3<Real> p = positions[wrong];
  std::ostringstream message;
  message << of << "node " << wrong << ": its position (" << p.x << ", " << p.y << ", " << p.z
          << ") is not finite";
  throw InvalidMesh("NON_FINITE_COORDINATE", message.str(), {{"node", std::to_string(wrong)}});
}

}  // namespace

std::size_t TopologyView::element_count() const {
  std::size_t count = 0;
  for (const ElementBlockView& block : blocks) count += block.element_count();
  return count;
}

PositionsView as_view(const PositionsSpan& positions) {
  return std::visit([](auto span) -> PositionsView { return span; }, positions);
}

std::size_t position_count(const PositionsView& positions) {
  return std::visit([](auto span) { return span.size(); }, positions);
}

std::size_t Mesh::node_count() const { return position_count(positions_view()); }

std::size_t Mesh::element_count() const { return MeshTopology(*this).view().element_count(); }

PositionsView Mesh::positions_view() const {
  return std::visit([](const auto& own) -> PositionsView { return std::span(own); }, positions);
}

PositionsSpan Mesh::positions_span() {
  return std::visit([](auto& own) -> PositionsSpan { return std::span(own); }, positions);
}

std::vector<ElementBlockView> Mesh::block_views() const {
  std::vector<ElementBlockView> views;
  views.reserve(blocks.size());
  for (const ElementBlock& block : blocks) views.push_back({block.type, block.nodes});
  return views;
}

void validate_sizes(const TopologyView& topology, const PositionsView& positions) {
  validate_sizes(topology);
  if (position_count(positions) == topology.node_count) return;
  throw_size("the mesh has " + std::to_string(topology.node_count) + " nodes but " +
             std::to_string(position_count(positions)) + " positions");
}

void throw_repeated_node(std::size_t element, ElementType type, std::span<const NodeId> nodes) {
  const int at = find_wrong_node(nodes.data(), static_cast<int>(nodes.size()),
                                 std::numeric_limits<NodeId>::max());
  const NodeInElement node(element, type, nodes[static_cast<std::size_t>(at)]);
  throw InvalidMesh("REPEATED_NODE", node.text + " occurs more than once", node.details);
}

void validate(const TopologyView& topology) {
  validate_sizes(topology);
  std::size_t first_id = 0;
  for (const ElementBlockView& block : topology.blocks) {
    validate_elements(block, first_id, topology.node_count);
    first_id += block.element_count();
  }
}

void validate(const TopologyView& topology, const PositionsView& positions) {
  validate_sizes(topology, positions);
  validate(topology);
  std::visit([](auto span) { validate_finite(span); }, positions);
}

void validate_positions(const TopologyView& topology, const PositionsView& positions) {
  validate_sizes(topology, positions);
  std::visit([](auto span) { validate_finite(span); }, positions);
}

void validate_reference(const TopologyView& topology, const PositionsView& reference) {
  if (position_count(reference) != topology.node_count) {
    throw_size("the mesh has " + std::to_string(topology.node_count) + " nodes, its reference " +
               std::to_string(position_count(reference)));
  }
  std::visit([](auto span) { validate_finite(span, "reference: "); }, reference);
}

}  // namespace meshsmooth

#include "smooth/second_order/corner_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "meshsmooth/error.hpp"
#include "smooth/base/mesh_counts.hpp"

namespace meshsmooth::detail {
namespace {

// What a node is while the mesh is read; from 0 on the index of a node in the middle.
constexpr NodeId kUnused = -1;
constexpr NodeId kCorner = -2;

std::string list(std::span<const NodeId> nodes) {
  std::string text;
  for (const NodeId node : nodes) text += (text.empty() ? "" : ", ") + std::to_string(node);
  return text;
}

/// Corners of nodes in the middle of faces and elements beyond two for each: a face belongs to two
/// elements, but those of the boundary.
std::int64_t further_corners(const MeshSize& size) {
  double sum = 0;
  for (const ElementType type : kElementTypes) {
    const auto count = static_cast<double>(size.element_counts[static_cast<std::size_t>(type)]);
    const ElementShape& shape = element_shape(type);
    for (const MidNode& mid : mid_nodes(type)) {
      const bool face = shape.dimension == 3 && mid.corner_count == 4;
      if (mid.corner_count > 2) sum += (face ? 0.5 : 1) * count * (mid.corner_count - 2);
    }
    // A cube of n³ elements has 6 n² faces on its boundary, which count half.
    sum += 2 * 4.5 * std::pow(count, 2.0 / 3);
  }
  return static_cast<std::int64_t>(sum) + 64;
}

std::string in_the_middle(std::span<const NodeId> corners) {
  return "in the middle of the nodes " + list(corners);
}

[[noreturn]] void refuse(std::size_t element, ElementType type, NodeId node,
                         std::span<const NodeId> corners, const std::string& elsewhere) {
  throw InvalidMesh("MID_NODE_MISPLACED",
                    "element " + std::to_string(element) + " (" + std::string(element_name(type)) +
                        "): node " + std::to_string(node) + " is " + in_the_middle(corners) +
                        ", but in another element " + elsewhere +
                        "; the nodes of an element are in VTK's order, corners first",
                    {{"element", std::to_string(element)}, {"node", std::to_string(node)}});
}

}  // namespace

bool is_second_order(const TopologyView& topology) {
  return !topology.blocks.empty() && meshsmooth::is_second_order(topology.blocks.front().type);
}

bool is_second_order(const MeshSize& size) {
  return std::ranges::any_of(kElementTypes, [&](ElementType type) {
    return meshsmooth::is_second_order(type) &&
           size.element_counts[static_cast<std::size_t>(type)] > 0;
  });
}

CornerMesh::CornerMesh(const TopologyView& topology)
    : regions_(topology.regions), canonical_(topology.canonical) {
  mark_corners(topology);
  find_mids(topology);
  number_corners(topology);
}

void CornerMesh::mark_corners(const TopologyView& topology) {
  corner_of_.assign(topology.node_count, kUnused);
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    const auto corner_count = static_cast<std::size_t>(element_shape(block.type).node_count);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      for (const NodeId node : block.nodes.subspan(at, corner_count)) {
        corner_of_[static_cast<std::size_t>(node)] = kCorner;
      }
    }
  }
  const auto others =
      static_cast<std::size_t>(std::count(corner_of_.begin(), corner_of_.end(), kUnused));
  mids_.reserve(others);
  first_corner_.reserve(others + 1);
  corners_.reserve(2 * others +
                   static_cast<std::size_t>(further_corners(detail::size_of(topology))));
}

void CornerMesh::find_mids(const TopologyView& topology) {
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    const auto corner_count = static_cast<std::size_t>(element_shape(block.type).node_count);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      const std::span nodes = block.nodes.subspan(at, width);
      const NodeId* node = &nodes[corner_count];
      for (const MidNode& mid : mid_nodes(block.type)) {
        add_mid(element, block.type, nodes, mid, *node++);
      }
    }
  }
}

void CornerMesh::add_mid(std::size_t element, ElementType type, std::span<const NodeId> nodes,
                         const MidNode& place, NodeId node) {
  const auto count = static_cast<std::size_t>(place.corner_count);
  std::array<NodeId, kMaxCorners> corners{};
  for (std::size_t c = 0; c < count; ++c) {
    corners[c] = nodes[static_cast<std::size_t>(place.corners[c])];
  }
  const std::span own = std::span(corners).first(count);
  std::ranges::sort(own);
  NodeId& role = corner_of_[static_cast<std::size_t>(node)];
  if (role == kUnused) {
    role = static_cast<NodeId>(mids_.size());
    mids_.push_back(node);
    corners_.insert(corners_.end(), own.begin(), own.end());
    first_corner_.push_back(corners_.size());
  } else if (role == kCorner) {
    refuse(element, type, node, own, "a corner");
  } else if (const auto known = mid(static_cast<std::size_t>(role)).corners;
             !std::ranges::equal(known, own)) {
    refuse(element, type, node, own, in_the_middle(known));
  }
}

void CornerMesh::number_corners(const TopologyView& topology) {
  nodes_.reserve(corner_of_.size() - mids_.size());
  for (NodeId& role : corner_of_) {
    const auto node = static_cast<NodeId>(&role - corner_of_.data());
    if (role >= 0) {
      role = -1;
    } else {
      role = static_cast<NodeId>(nodes_.size());
      nodes_.push_back(node);
    }
  }
  for (NodeId& corner : corners_) corner = corner_of(corner);
  if (!topology.fixed.empty()) {
    fixed_.reserve(nodes_.size());
    for (const NodeId node : nodes_) {
      fixed_.push_back(topology.fixed[static_cast<std::size_t>(node)]);
    }
  }
  blocks_.reserve(topology.blocks.size());
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    const auto corner_count = static_cast<std::size_t>(element_shape(block.type).node_count);
    std::vector<NodeId> nodes;
    nodes.reserve(block.element_count() * corner_count);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      for (const NodeId node : block.nodes.subspan(at, corner_count)) {
        nodes.push_back(corner_of(node));
      }
    }
    blocks_.push_back({linear_type(block.type), std::move(nodes)});
  }
  for (const ElementBlock& block : blocks_) views_.push_back({block.type, block.nodes});
}

TopologyView CornerMesh::view() const {
  return {nodes_.size(), views_, fixed_, regions_, canonical_};
}

std::int64_t CornerMesh::bytes() const {
  std::size_t bytes = fixed_.capacity() + first_corner_.capacity() * sizeof(std::size_t);
  for (const auto* ids : {&nodes_, &corner_of_, &mids_, &corners_}) {
    bytes += ids->capacity() * sizeof(NodeId);
  }
  for (const ElementBlock& block : blocks_) bytes += block.nodes.capacity() * sizeof(NodeId);
  return static_cast<std::int64_t>(bytes);
}

MeshSize CornerMesh::size_of(const MeshSize& size) {
  if (!detail::is_second_order(size)) return size;
  MeshSize linear{.node_count = size.node_count, .float64 = size.float64, .regions = size.regions};
  linear.element_counts.fill(0);
  // Euler: edges = nodes + facets - elements (+ 1 or so), of a surface nodes + elements. A facet
  // belongs to two elements at most, so that this is the least number of facets.
  double mids = 0;  // besides one for each corner
  for (const ElementType type : kElementTypes) {
    const auto row = static_cast<std::size_t>(type);
    const auto count = static_cast<double>(size.element_counts[row]);
    if (count == 0) continue;
    const ElementShape& shape = element_shape(type);
    linear.element_counts[static_cast<std::size_t>(linear_type(type))] += size.element_counts[row];
    mids += count * (shape.dimension == 3 ? shape.facet_count / 2.0 - 1.0 : 1.0);
    for (const MidNode& mid : mid_nodes(type)) {
      if (mid.corner_count == 4 && shape.dimension == 3) mids += count / 2;
      if (mid.corner_count == shape.node_count && mid.corner_count > 2) mids += count;
    }
  }
  const double corners = (static_cast<double>(size.node_count) - mids) / 2 + 64;
  linear.node_count =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(corners), 1, size.node_count);
  return linear;
}

std::int64_t CornerMesh::estimate_bytes(const MeshSize& size) {
  if (!detail::is_second_order(size)) return 0;
  const MeshSize linear = size_of(size);
  std::int64_t entries = 0;
  for (const ElementType type : kElementTypes) {
    entries += size.element_counts[static_cast<std::size_t>(type)] * element_shape(type).node_count;
  }
  constexpr auto id = static_cast<std::int64_t>(sizeof(NodeId));
  constexpr auto offset = static_cast<std::int64_t>(sizeof(std::size_t));
  // There are no more corners than estimated, in small meshes a third fewer.
  const std::int64_t mids = size.node_count - linear.node_count / 2;
  return offset + size.node_count * id + linear.node_count * (id + 1) + mids * (3 * id + offset) +
         further_corners(size) * id + entries * id;
}

}  // namespace meshsmooth::detail

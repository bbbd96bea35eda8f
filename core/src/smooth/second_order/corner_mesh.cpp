#include "smooth/second_order/corner_mesh.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "meshsmooth/error.hpp"

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

[[noreturn]] void refuse(std::size_t element, ElementType type, NodeId node,
                         const std::string& here, const std::string& there) {
  throw InvalidMesh("MID_NODE_MISPLACED",
                    "element " + std::to_string(element) + " (" + std::string(element_name(type)) +
                        "): node " + std::to_string(node) + " is " + here +
                        ", but in an element before it " + there +
                        "; the nodes of an element are in VTK's order, corners first",
                    {{"element", std::to_string(element)}, {"node", std::to_string(node)}});
}

std::string in_the_middle(std::span<const NodeId> corners) {
  return "in the middle of the nodes " + list(corners);
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

CornerMesh::CornerMesh(const TopologyView& topology) : regions_(topology.regions) {
  find_mids(topology);
  number_corners(topology);
}

void CornerMesh::find_mids(const TopologyView& topology) {
  std::vector<NodeId>& roles = corner_of_;
  roles.assign(topology.node_count, kUnused);
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    const auto corner_count = static_cast<std::size_t>(element_shape(block.type).node_count);
    const std::span<const MidNode> mids = mid_nodes(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width, ++element) {
      const std::span nodes = block.nodes.subspan(at, width);
      for (const NodeId node : nodes.first(corner_count)) {
        NodeId& role = roles[static_cast<std::size_t>(node)];
        if (role >= 0) {
          const auto mid_corners = mid(static_cast<std::size_t>(role)).corners;
          refuse(element, block.type, node, "a corner", in_the_middle(mid_corners));
        }
        role = kCorner;
      }
      for (std::size_t m = 0; m < mids.size(); ++m) {
        const auto count = static_cast<std::size_t>(mids[m].corner_count);
        std::array<NodeId, kMaxCorners> corners{};
        for (std::size_t c = 0; c < count; ++c) {
          corners[c] = nodes[static_cast<std::size_t>(mids[m].corners[c])];
        }
        const std::span own = std::span(corners).first(count);
        std::ranges::sort(own);
        const NodeId node = nodes[corner_count + m];
        NodeId& role = roles[static_cast<std::size_t>(node)];
        if (role == kUnused) {
          role = static_cast<NodeId>(mids_.size());
          mids_.push_back(node);
          corners_.insert(corners_.end(), own.begin(), own.end());
          first_corner_.push_back(corners_.size());
        } else if (role == kCorner) {
          refuse(element, block.type, node, in_the_middle(own), "a corner");
        } else if (const auto known = mid(static_cast<std::size_t>(role)).corners;
                   !std::ranges::equal(known, own)) {
          refuse(element, block.type, node, in_the_middle(own), in_the_middle(known));
        }
      }
    }
  }
}

void CornerMesh::number_corners(const TopologyView& topology) {
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

TopologyView CornerMesh::view() const { return {nodes_.size(), views_, fixed_, regions_}; }

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
  std::int64_t others = 0;  // nodes in the middle of faces and elements, at most
  for (const ElementType type : kElementTypes) {
    const std::int64_t count = size.element_counts[static_cast<std::size_t>(type)];
    entries += count * element_shape(type).node_count;
    for (const MidNode& mid : mid_nodes(type)) others += mid.corner_count > 2 ? count : 0;
  }
  // Vectors that grow have up to twice their size.
  const std::int64_t per_mid = 2 * (sizeof(NodeId) + sizeof(std::size_t) + 2 * sizeof(NodeId));
  return size.node_count * static_cast<std::int64_t>(sizeof(NodeId)) +
         linear.node_count * static_cast<std::int64_t>(2 * sizeof(NodeId) + 1) +
         (size.node_count - linear.node_count / 2) * per_mid +
         others * static_cast<std::int64_t>(2 * 6 * sizeof(NodeId)) +
         entries * static_cast<std::int64_t>(sizeof(NodeId));
}

}  // namespace meshsmooth::detail

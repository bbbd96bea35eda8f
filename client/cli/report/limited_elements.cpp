#include "report/limited_elements.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <variant>
#include <vector>

#include "meshsmooth/smoother.hpp"

namespace meshsmooth::cli {
namespace {

/// Whether the energy of a ball follows from its result, and `fixed` tells which nodes may move.
bool can_be_told(const TopologyView& topology, const SmoothOptions& options) {
  const auto* method = std::get_if<Optimize>(&options.method);
  if (method == nullptr || method->stay > 0 || aims_at_reference(options)) return false;
  if (options.boundary == BoundaryPolicy::slide || options.movement_limit || options.only_below)
    return false;
  return std::ranges::all_of(topology.blocks, [&](const ElementBlockView& block) {
    return element_shape(block.type).dimension == 3 && !is_second_order(block.type) &&
           (method->target == Target::ideal ||
            (method->target == Target::automatic && block.type == ElementType::tetrahedron));
  });
}

/// The elements at the nodes of some elements.
class Balls {
 public:
  struct Cell {
    ElementType type;
    const NodeId* nodes;
  };

  Balls(const TopologyView& topology, std::span<ShownElement* const> elements) {
    std::vector<std::uint8_t> wanted(topology.node_count);
    for (const ShownElement* shown : elements) {
      for (const NodeId node : nodes_of({shown->type, shown->nodes}))
        wanted[static_cast<std::size_t>(node)] = 1;
    }
    for (const ElementBlockView& block : topology.blocks) {
      const auto width = element_width(block.type);
      for (std::size_t at = 0; at < block.nodes.size(); at += width) {
        const Cell cell{block.type, &block.nodes[at]};
        for (const NodeId node : nodes_of(cell)) {
          if (wanted[static_cast<std::size_t>(node)] != 0) cells_[node].push_back(cell);
        }
      }
    }
  }

  [[nodiscard]] static std::span<const NodeId> nodes_of(const Cell& cell) {
    return {cell.nodes, element_width(cell.type)};
  }
  [[nodiscard]] const std::vector<Cell>& operator[](NodeId node) const { return cells_.at(node); }

 private:
  std::unordered_map<NodeId, std::vector<Cell>> cells_;
};

/// The balls of an element's nodes as a mesh, where only these may move.
Mesh cut_out(const DrawnMesh& drawn, const Balls& balls, const ShownElement& shown,
             std::span<const std::uint8_t> fixed) {
  std::unordered_set<const NodeId*> taken;
  std::unordered_map<NodeId, NodeId> index;
  std::vector<NodeId> nodes;
  std::map<ElementType, std::vector<NodeId>> blocks;
  const auto own = Balls::nodes_of({shown.type, shown.nodes});
  for (const NodeId corner : own) {
    for (const Balls::Cell& cell : balls[corner]) {
      if (!taken.insert(cell.nodes).second) continue;
      for (const NodeId node : Balls::nodes_of(cell)) {
        const auto [found, added] = index.try_emplace(node, static_cast<NodeId>(nodes.size()));
        if (added) nodes.push_back(node);
        blocks[cell.type].push_back(found->second);
      }
    }
  }
  Mesh mesh;
  for (auto& [type, connectivity] : blocks) mesh.blocks.push_back({type, std::move(connectivity)});
  mesh.fixed.assign(nodes.size(), 1);
  for (const NodeId node : own) {
    mesh.fixed[static_cast<std::size_t>(index.at(node))] = fixed[static_cast<std::size_t>(node)];
  }
  std::visit(
      [&](const auto& all) {
        std::vector<std::decay_t<decltype(all[0])>> positions;
        for (const NodeId node : nodes) positions.push_back(all[static_cast<std::size_t>(node)]);
        mesh.positions = std::move(positions);
      },
      drawn.positions);
  return mesh;
}

}  // namespace

bool mark_limited(const DrawnMesh& mesh, std::span<ShownElement> elements,
                  const SmoothOptions& options, std::span<const std::uint8_t> fixed) {
  if (!can_be_told(mesh.topology, options)) return false;
  std::vector<ShownElement*> poor;
  for (ShownElement& shown : elements) {
    if (shown.measure.mean_ratio < *options.report_below && (shown.marks & kLocked) == 0)
      poor.push_back(&shown);
  }
  const Balls balls(mesh.topology, poor);
  const SmoothOptions trial{.method = options.method,
                            .form = options.form,
                            .max_iterations = 0,
                            .boundary = options.boundary,
                            .guard = options.guard,
                            .quality_detail = QualityDetail::brief,
                            .report_below = options.report_below};
  const std::unique_ptr<Smoother> smoother = make_smoother("cpu", 1);
  for (ShownElement* shown : poor) {
    Mesh part = cut_out(mesh, balls, *shown, fixed);
    const PoorElements held = smoother->smooth(part, trial).poor.value();
    // Those that neither are locked nor limited have a node that would move: one of this element.
    if (held.locked_count + held.limited_count == held.element_count) shown->marks |= kLimited;
  }
  return true;
}

}  // namespace meshsmooth::cli

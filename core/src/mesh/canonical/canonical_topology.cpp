#include "meshsmooth/canonical_topology.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <string>
#include <utility>

#include "mesh/canonical/collapsed_element.hpp"
#include "mesh/canonical/interface_element.hpp"
#include "mesh/parallel.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

/// Calls `visit(id, type, nodes)` for each element in order.
template <class Visit>
void for_each_element(std::span<const ElementBlockView> blocks, const Visit& visit) {
  std::size_t id = 0;
  for (const ElementBlockView& block : blocks) {
    const std::size_t width = element_width(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e) {
      visit(id++, block.type, block.nodes.subspan(e * width, width));
    }
  }
}

/// Marks the elements for which `is_one(type, nodes)`, by their ids; empty where there is none.
template <class IsOne>
std::vector<std::uint8_t> find_elements(const TopologyView& topology, const IsOne& is_one) {
  std::vector<std::uint8_t> found(topology.element_count());
  std::size_t first = 0;
  std::atomic<bool> any = false;
  for (const ElementBlockView& block : topology.blocks) {
    const std::size_t width = element_width(block.type);
    detail::parallel_for_ranges(block.element_count(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t e = begin; e < end; ++e) {
        if (!is_one(block.type, block.nodes.subspan(e * width, width))) continue;
        found[first + e] = 1;
        any.store(true, std::memory_order_relaxed);
      }
    });
    first += block.element_count();
  }
  if (!any) found.clear();
  return found;
}

}  // namespace

CanonicalTopology::CanonicalTopology(const TopologyView& topology)
    : view_(topology), caller_element_count_(topology.element_count()) {
  expand_collapsed(topology);
}

CanonicalTopology::CanonicalTopology(const TopologyView& topology, const PositionsView& positions,
                                     bool boundary_moves, const std::function<void()>& check)
    : CanonicalTopology(topology) {
  leave_out_interfaces(positions);
  check();
  if (boundary_moves) fix_coincident(positions);
  numbering_ = find_numbering(view_, positions, check);
  check();
  if (numbering_.mirrored_count > 0) {
    if (blocks_.empty()) {
      for (const ElementBlockView& block : view_.blocks) {
        blocks_.push_back({block.type, {block.nodes.begin(), block.nodes.end()}});
      }
    }
    mirror_elements(blocks_, numbering_.mirrored);
    view_blocks();
  }
  view_.canonical = true;
}

void CanonicalTopology::add(ElementType type, std::span<const NodeId> nodes) {
  if (blocks_.empty() || blocks_.back().type != type) blocks_.push_back({type, {}});
  auto& all = blocks_.back().nodes;
  all.insert(all.end(), nodes.begin(), nodes.end());
}

void CanonicalTopology::view_blocks() {
  block_views_.clear();
  for (const ElementBlock& block : blocks_) block_views_.push_back({block.type, block.nodes});
  view_.blocks = block_views_;
}

void CanonicalTopology::expand_collapsed(const TopologyView& topology) {
  const auto collapsed = find_elements(topology, [](ElementType, std::span<const NodeId> nodes) {
    return detail::repeats_nodes(nodes);
  });
  if (collapsed.empty()) return;
  for_each_element(topology.blocks,
                   [&](std::size_t id, ElementType type, std::span<const NodeId> nodes) {
                     if (collapsed[id] == 0) return add(type, nodes);
                     const auto element = detail::expand(type, nodes);
                     if (!element) throw_repeated_node(id, type, nodes);
                     add(element->type, element->list());
                     ++collapsed_count_;
                   });
  view_blocks();
}

void CanonicalTopology::leave_out_interfaces(const PositionsView& positions) {
  const auto interfaces = std::visit(
      [&](const auto& span) {
        return find_elements(view_, [&](ElementType type, std::span<const NodeId> nodes) {
          return detail::is_interface(element_shape(type), [&](int n) {
            return vec3_cast<double>(
                span[static_cast<std::size_t>(nodes[static_cast<std::size_t>(n)])]);
          });
        });
      },
      positions);
  const auto count = std::ranges::count(interfaces, 1);
  // A mesh of interfaces alone is none.
  if (count == 0 || static_cast<std::size_t>(count) == view_.element_count()) return;

  interface_count_ = count;
  const auto before = std::exchange(blocks_, {});
  for_each_element(view_.blocks,
                   [&](std::size_t id, ElementType type, std::span<const NodeId> nodes) {
                     if (interfaces[id] != 0) {
                       for (const NodeId node : nodes) fix(node);
                       return;
                     }
                     add(type, nodes);
                     ids_.push_back(static_cast<std::int64_t>(id));
                     if (!view_.regions.empty()) regions_.push_back(view_.regions[id]);
                   });
  view_blocks();
  view_.regions = regions_;
}

void CanonicalTopology::fix(NodeId node) {
  if (fixed_.empty()) {
    fixed_.assign(view_.fixed.begin(), view_.fixed.end());
    fixed_.resize(view_.node_count);
    view_.fixed = fixed_;
  }
  fixed_[static_cast<std::size_t>(node)] = 1;
}

void CanonicalTopology::fix_coincident(const PositionsView& positions) {
  std::visit(
      [&]<class Real>(std::span<const Vec3<Real>> span) {
        std::vector<NodeId> nodes = find_boundary_nodes(view_);
        const auto key = [&](NodeId node) {
          const Vec3<Real> p = span[static_cast<std::size_t>(node)];
          return std::array<Real, 3>{p.x, p.y, p.z};
        };
        std::ranges::sort(nodes, {}, key);
        for (std::size_t first = 0, end = 0; first < nodes.size(); first = end) {
          while (end < nodes.size() && key(nodes[end]) == key(nodes[first])) ++end;
          if (end - first < 2) continue;
          for (std::size_t n = first; n < end; ++n) fix(nodes[n]);
          coincident_count_ += static_cast<std::int64_t>(end - first);
        }
      },
      positions);
}

std::int64_t CanonicalTopology::bytes() const {
  std::size_t sum = fixed_.size() + regions_.size() * sizeof(std::int32_t) +
                    ids_.size() * sizeof(std::int64_t) + numbering_.mirrored.size() +
                    block_views_.size() * sizeof(ElementBlockView);
  for (const ElementBlock& block : blocks_) sum += block.nodes.capacity() * sizeof(NodeId);
  return static_cast<std::int64_t>(sum);
}

void CanonicalTopology::complete(QualityStats& stats) const {
  for (ElementQuality& worst : stats.worst) worst.element = caller_id(worst.element);
  stats.collapsed_count = collapsed_count_;
  stats.interface_count = interface_count_;
  stats.mirrored_count = numbering_.mirrored_count;
  stats.mirrored.clear();
  for (std::size_t e = 0; e < numbering_.mirrored.size(); ++e) {
    if (numbering_.mirrored[e] == 0) continue;
    if (stats.mirrored.size() == kMostListedMirrored) break;
    stats.mirrored.push_back(caller_id(static_cast<std::int64_t>(e)));
  }
}

void CanonicalTopology::complete(ElementQualityArrays& arrays) const {
  if (ids_.empty() || arrays.metrics.empty()) return;
  std::vector<float> values;
  for (std::size_t m = 0; m < arrays.metrics.size(); ++m) {
    const auto all = in_caller_order(arrays.of(m), std::numeric_limits<float>::quiet_NaN());
    values.insert(values.end(), all.begin(), all.end());
  }
  arrays.values = std::move(values);
}

}  // namespace meshsmooth

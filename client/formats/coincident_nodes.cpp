#include "coincident_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <variant>

namespace meshsmooth::formats {

CoincidentNodes::CoincidentNodes(const PositionsView& positions) {
  std::visit(
      [this](const auto& points) {
        representative_.resize(points.size());
        std::iota(representative_.begin(), representative_.end(), 0);
        const auto at = [&](NodeId node) { return points[static_cast<std::size_t>(node)]; };
        const auto key = [&](NodeId node) {
          const auto p = at(node);
          return std::tuple(p.x, p.y, p.z, node);
        };
        std::vector<NodeId> order = representative_;
        // A NaN has no place in an order.
        std::erase_if(order, [&](NodeId node) {
          const auto p = at(node);
          return !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z);
        });
        std::ranges::sort(order, {}, key);
        for (std::size_t i = 1; i < order.size(); ++i) {
          if (!(at(order[i]) == at(order[i - 1]))) continue;
          representative_[static_cast<std::size_t>(order[i])] =
              representative_[static_cast<std::size_t>(order[i - 1])];
          ++merged_count_;
        }
      },
      positions);
}

NodeId CoincidentNodes::representative(NodeId node) const {
  const auto index = static_cast<std::size_t>(node);
  return node < 0 || index >= representative_.size() ? node : representative_[index];
}

void CoincidentNodes::merge(Mesh& mesh) const {
  for (ElementBlock& block : mesh.blocks) {
    for (NodeId& node : block.nodes) node = representative(node);
  }
  for (std::size_t node = 0; node < mesh.fixed.size(); ++node) {
    if (mesh.fixed[node] == 0) continue;
    mesh.fixed[static_cast<std::size_t>(representative(static_cast<NodeId>(node)))] = 1;
  }
}

void CoincidentNodes::spread(Mesh& mesh) const {
  std::visit(
      [this](auto& points) {
        for (std::size_t node = 0; node < points.size(); ++node) {
          points[node] = points[static_cast<std::size_t>(representative_[node])];
        }
      },
      mesh.positions);
}

}  // namespace meshsmooth::formats

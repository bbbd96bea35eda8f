#include "locked_elements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <variant>

#include "readable.hpp"

namespace meshsmooth::cli {
namespace {

/// How many different positions the nodes have.
std::int64_t count_positions(const Mesh& mesh) {
  return std::visit(
      [](auto positions) {
        const auto key = [](const auto& p) { return std::tuple(p.x, p.y, p.z); };
        std::ranges::sort(positions, {}, key);
        const auto repeated = std::ranges::unique(positions, {}, key);
        return static_cast<std::int64_t>(repeated.begin() - positions.begin());
      },
      mesh.positions);
}

}  // namespace

std::string describe_locked(const LockedStats& locked,
                            const std::function<std::int64_t(std::int64_t)>& file_element_id) {
  if (locked.element_count == 0) return {};
  std::string text = fmt::format("{} {} locked: all nodes fixed, no smoothing can repair {}",
                                 counted(locked.element_count, "element"),
                                 locked.element_count == 1 ? "is" : "are",
                                 locked.element_count == 1 ? "it" : "them");
  if (locked.inverted_count > 0) {
    text += fmt::format("; {} of them inverted", with_commas(locked.inverted_count));
  }
  if (locked.worst) {
    text += fmt::format("; the worst, element {}, has mean ratio {:.4f}",
                        file_element_id(locked.worst->element), locked.worst->mean_ratio);
  }
  return text + "\n";
}

std::string describe_locked_mesh(const Mesh& mesh, const SmoothSummary& summary,
                                 const SmoothOptions& options) {
  if (summary.locked.element_count < summary.quality_after.element_count) return {};
  const auto nodes = static_cast<std::int64_t>(mesh.node_count());
  const std::int64_t positions = count_positions(mesh);
  std::string text = "no node can move: all are fixed";
  // A few pairs are meant, as at a crack.
  if (10 * positions < 9 * nodes) {
    text += fmt::format("; {} are at {}: --merge-coincident smooths them as one",
                        counted(nodes, "node"), counted(positions, "position"));
  } else if (options.boundary == BoundaryPolicy::fixed && summary.nodes.boundary > 0) {
    const bool volume = element_shape(mesh.blocks.front().type).dimension == 3;
    text += fmt::format("; {} on the boundary{}, where --boundary slide lets them move",
                        counted(summary.nodes.boundary, "node"),
                        volume ? ", as in a mesh of one layer of elements" : "");
  }
  return text + "\n";
}

}  // namespace meshsmooth::cli

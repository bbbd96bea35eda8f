#include "report/shown_elements.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <numeric>
#include <tuple>
#include <variant>

namespace meshsmooth::cli {
namespace {

ElementMeasure measure(const DrawnMesh& mesh, const PositionsView& positions,
                       const ShownElement& shown) {
  std::array<Vec3d, kMaxElementNodes> nodes;
  const std::size_t count = element_width(shown.type);
  for (std::size_t n = 0; n < count; ++n) nodes[n] = position_of(positions, shown.nodes[n]);
  return measure_element(shown.type, nodes.data(), mesh.orientation.reference(shown.element));
}

/// The elements of blocks by their ids.
ShownElement find_element(const TopologyView& topology, std::size_t element) {
  std::size_t first = 0;
  for (const ElementBlockView& block : topology.blocks) {
    if (const std::size_t index = element - first; index < block.element_count()) {
      const auto width = element_width(block.type);
      return {.element = element, .type = block.type, .nodes = &block.nodes[index * width]};
    }
    first += block.element_count();
  }
  return {};
}

/// Mean ratios by which inverted elements rank below all others, interface elements above.
std::vector<float> rank_elements(const DrawnMesh& mesh, const PositionsView& positions) {
  std::vector<float> ranks =
      measure_elements(mesh.topology, positions, mesh.orientation, {QualityMetric::mean_ratio})
          .values;
  // Other than simplices these may be inverted between corners that are valid.
  std::size_t element = 0;
  for (const ElementBlockView& block : mesh.topology.blocks) {
    const bool simplex =
        block.type == ElementType::triangle || block.type == ElementType::tetrahedron;
    const auto width = element_width(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e, ++element) {
      // Between the corners of a better element the Jacobian does not change its sign.
      if (simplex || ranks[element] > 0.5) continue;
      const ShownElement shown{
          .element = element, .type = block.type, .nodes = &block.nodes[e * width]};
      if (measure(mesh, positions, shown).inverted) ranks[element] -= 2;
    }
  }
  for (std::size_t e = 0; e < mesh.interfaces.size(); ++e) {
    if (mesh.interfaces[e] != 0) ranks[e] = std::numeric_limits<float>::infinity();
  }
  return ranks;
}

/// The ids of the lowest ranks.
std::vector<std::size_t> find_worst(const std::vector<float>& ranks, std::size_t count) {
  std::vector<std::size_t> ids(ranks.size());
  std::iota(ids.begin(), ids.end(), std::size_t{0});
  const auto worse = [&](std::size_t a, std::size_t b) {
    return std::tuple(ranks[a], a) < std::tuple(ranks[b], b);
  };
  count = std::min(count, ids.size());
  std::ranges::nth_element(ids, ids.begin() + static_cast<std::ptrdiff_t>(count), worse);
  ids.resize(count);
  return ids;
}

std::uint8_t marks_of(const DrawnMesh& mesh, const ShownElement& shown,
                      std::span<const std::uint8_t> fixed) {
  const std::span nodes(shown.nodes, element_width(shown.type));
  std::uint8_t marks = 0;
  if (!fixed.empty() && std::ranges::all_of(nodes, [&](NodeId n) {
        return fixed[static_cast<std::size_t>(n)] != 0;
      })) {
    marks |= kLocked;
  }
  if (mesh.before && std::ranges::all_of(nodes, [&](NodeId n) {
        return position_of(mesh.positions, n) == position_of(*mesh.before, n);
      })) {
    marks |= kNotMoved;
  }
  return marks;
}

}  // namespace

Vec3d position_of(const PositionsView& positions, NodeId node) {
  return std::visit(
      [&](const auto& all) { return vec3_cast<double>(all[static_cast<std::size_t>(node)]); },
      positions);
}

Vec3d centre_of(const PositionsView& positions, std::span<const NodeId> nodes) {
  Vec3d sum{};
  for (const NodeId node : nodes) sum += position_of(positions, node);
  return (1.0 / static_cast<double>(nodes.size())) * sum;
}

std::vector<ShownElement> choose_elements(const DrawnMesh& mesh, std::size_t count,
                                          std::span<const std::int64_t> blocking,
                                          std::span<const std::uint8_t> fixed) {
  const std::vector<float> ranks = rank_elements(mesh, mesh.positions);
  std::vector<std::size_t> ids = find_worst(ranks, mesh.before ? count / 2 : count);
  if (mesh.before) {
    const auto more = find_worst(rank_elements(mesh, *mesh.before), count / 2);
    ids.insert(ids.end(), more.begin(), more.end());
  }
  for (const std::int64_t element : blocking) ids.push_back(static_cast<std::size_t>(element));
  std::ranges::sort(ids, {}, [&](std::size_t id) { return std::tuple(ranks[id], id); });
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  if (!mesh.interfaces.empty()) {
    std::erase_if(ids, [&](std::size_t id) { return mesh.interfaces[id] != 0; });
  }

  std::vector<ShownElement> elements;
  for (const std::size_t id : ids) {
    ShownElement shown = find_element(mesh.topology, id);
    shown.measure = measure(mesh, mesh.positions, shown);
    shown.before = mesh.before ? measure(mesh, *mesh.before, shown) : shown.measure;
    shown.marks = marks_of(mesh, shown, fixed);
    if (std::ranges::find(blocking, static_cast<std::int64_t>(id)) != blocking.end()) {
      shown.marks |= kBlocksMotion;
    }
    elements.push_back(shown);
  }
  return elements;
}

}  // namespace meshsmooth::cli

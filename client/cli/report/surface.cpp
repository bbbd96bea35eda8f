#include "report/surface.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace meshsmooth::cli {
namespace {

using Facet = std::array<NodeId, kMaxFacetNodes>;

/// Turns numbers of nodes in the mesh into indices of those that are drawn.
class DrawnNodes {
 public:
  explicit DrawnNodes(std::size_t node_count) : index_(node_count, kNone) {}
  std::uint32_t operator()(NodeId node) {
    std::uint32_t& index = index_[static_cast<std::size_t>(node)];
    if (index == kNone) {
      index = static_cast<std::uint32_t>(nodes.size());
      nodes.push_back(node);
    }
    return index;
  }
  std::vector<NodeId> nodes;

 private:
  static constexpr auto kNone = static_cast<std::uint32_t>(-1);
  std::vector<std::uint32_t> index_;
};

void add_facet(Surface& surface, DrawnNodes& drawn, const Facet& nodes, int count,
               std::size_t element) {
  std::array<std::uint32_t, kMaxFacetNodes> corners{};
  for (int n = 0; n < count; ++n) corners[n] = drawn(nodes[n]);
  const auto id = static_cast<std::uint32_t>(element);
  if (count == 3) {
    surface.triangles.push_back({{corners[0], corners[1], corners[2]}, id, 0b111});
  } else {
    surface.triangles.push_back({{corners[0], corners[1], corners[2]}, id, 0b011});
    surface.triangles.push_back({{corners[0], corners[2], corners[3]}, id, 0b110});
  }
}

Facet nodes_of(const FacetShape& facet, const NodeId* element) {
  Facet nodes{-1, -1, -1, -1};
  for (int n = 0; n < facet.node_count; ++n) nodes[n] = element[facet.nodes[n]];
  return nodes;
}

/// A facet by its element and number there.
struct FacetRef {
  std::uint32_t element;
  std::uint8_t facet;
};

/// The facets of all elements, by their least node.
class FacetsByNode {
 public:
  explicit FacetsByNode(const TopologyView& topology) : first_(topology.node_count + 1) {
    for_each(topology,
             [&](NodeId least, FacetRef) { ++first_[static_cast<std::size_t>(least) + 1]; });
    for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
    facets_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each(topology, [&](NodeId least, FacetRef facet) {
      facets_[next[static_cast<std::size_t>(least)]++] = facet;
    });
  }
  [[nodiscard]] std::span<const FacetRef> of(std::size_t node) const {
    return std::span(facets_).subspan(first_[node], first_[node + 1] - first_[node]);
  }

 private:
  template <class Add>
  static void for_each(const TopologyView& topology, Add&& add) {
    std::uint32_t element = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const ElementShape& shape = element_shape(block.type);
      const std::size_t width = element_width(block.type);
      for (std::size_t e = 0; e < block.element_count(); ++e, ++element) {
        for (int f = 0; f < shape.facet_count; ++f) {
          const Facet nodes = nodes_of(shape.facets[f], &block.nodes[e * width]);
          const auto count = static_cast<std::size_t>(shape.facets[f].node_count);
          add(std::ranges::min(std::span(nodes).first(count)),
              FacetRef{element, static_cast<std::uint8_t>(f)});
        }
      }
    }
  }

  std::vector<std::size_t> first_;
  std::vector<FacetRef> facets_;
};

/// The type and the nodes of an element by its id.
class Elements {
 public:
  explicit Elements(const TopologyView& topology) {
    std::size_t first = 0;
    for (const ElementBlockView& block : topology.blocks) {
      first_.push_back(first);
      first += block.element_count();
    }
    blocks_ = topology.blocks;
  }
  [[nodiscard]] std::pair<const ElementShape&, const NodeId*> operator[](
      std::size_t element) const {
    const auto b =
        static_cast<std::size_t>(std::ranges::upper_bound(first_, element) - first_.begin()) - 1;
    const ElementShape& shape = element_shape(blocks_[b].type);
    return {shape, &blocks_[b].nodes[(element - first_[b]) * element_width(blocks_[b].type)]};
  }

 private:
  std::vector<std::size_t> first_;
  std::span<const ElementBlockView> blocks_;
};

void add_boundary(Surface& surface, DrawnNodes& drawn, const TopologyView& topology) {
  struct Candidate {
    Facet sorted;
    FacetRef ref;
  };
  const FacetsByNode facets(topology);
  const Elements elements(topology);
  std::vector<Candidate> candidates;
  for (std::size_t node = 0; node < topology.node_count; ++node) {
    candidates.clear();
    for (const FacetRef ref : facets.of(node)) {
      const auto [shape, nodes] = elements[ref.element];
      Facet sorted = nodes_of(shape.facets[ref.facet], nodes);
      std::ranges::sort(sorted);
      candidates.push_back({sorted, ref});
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::sorted);
    for (std::size_t first = 0, last = 0; first < candidates.size(); first = last) {
      while (last < candidates.size() && candidates[last].sorted == candidates[first].sorted)
        ++last;
      if (last - first > 1) continue;
      const FacetRef ref = candidates[first].ref;
      const auto [shape, nodes] = elements[ref.element];
      const FacetShape& facet = shape.facets[ref.facet];
      add_facet(surface, drawn, nodes_of(facet, nodes), facet.node_count, ref.element);
    }
  }
}

}  // namespace

Surface find_surface(const TopologyView& topology) {
  Surface surface;
  DrawnNodes drawn(topology.node_count);
  if (element_shape(topology.blocks.front().type).dimension == 3) {
    add_boundary(surface, drawn, topology);
  } else {
    std::size_t element = 0;
    for (const ElementBlockView& block : topology.blocks) {
      const int corner_count = element_shape(block.type).node_count;
      for (std::size_t e = 0; e < block.element_count(); ++e) {
        Facet nodes{-1, -1, -1, -1};
        for (int n = 0; n < corner_count; ++n)
          nodes[n] = block.nodes[e * element_width(block.type) + static_cast<std::size_t>(n)];
        add_facet(surface, drawn, nodes, corner_count, element++);
      }
    }
  }
  surface.nodes = std::move(drawn.nodes);
  surface.whole_count = surface.triangles.size();
  return surface;
}

Surface simplify(const Surface& surface, std::span<const Vec3d> positions, int cells) {
  Vec3d lower = positions.front(), upper = lower;
  for (const Vec3d p : positions) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
  const Vec3d size = upper - lower;
  const double extent = std::max({size.x, size.y, size.z});
  const auto cell = [&](double offset) {
    return extent > 0 ? static_cast<std::uint64_t>(offset / extent * (cells - 1) + 0.5) : 0;
  };
  Surface simple{.whole_count = surface.whole_count};
  std::unordered_map<std::uint64_t, std::uint32_t> merged;  // by cell
  std::vector<std::uint32_t> index(surface.nodes.size());
  for (std::size_t n = 0; n < index.size(); ++n) {
    const Vec3d offset = positions[n] - lower;
    const std::uint64_t key = cell(offset.x) << 42 | cell(offset.y) << 21 | cell(offset.z);
    const auto [found, added] =
        merged.try_emplace(key, static_cast<std::uint32_t>(simple.nodes.size()));
    if (added) simple.nodes.push_back(surface.nodes[n]);
    index[n] = found->second;
  }
  for (const Surface::Triangle& triangle : surface.triangles) {
    const auto [a, b, c] = triangle.corners;
    if (index[a] == index[b] || index[b] == index[c] || index[c] == index[a]) continue;
    simple.triangles.push_back({{index[a], index[b], index[c]}, triangle.element, 0});
  }
  return simple;
}

}  // namespace meshsmooth::cli

#include "smooth/base/refusals.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/error.hpp"
#include "smooth/base/topology.hpp"

namespace meshsmooth::detail {

namespace {

/// A facet of an element.
struct Use {
  FacetKey key;
  std::size_t element;
  std::span<const NodeId> nodes;  // of the element
};

/// Of the uses of a facet, two of elements that have the same nodes; null if there are none.
std::pair<const Use*, const Use*> find_twins(std::span<const Use> uses) {
  const auto sorted = [](std::span<const NodeId> nodes) {
    std::vector<NodeId> copy(nodes.begin(), nodes.end());
    std::ranges::sort(copy);
    return copy;
  };
  std::map<std::vector<NodeId>, const Use*> known;
  for (const Use& use : uses) {
    const auto [first, is_new] = known.try_emplace(sorted(use.nodes), &use);
    if (!is_new) return {first->second, &use};
  }
  return {nullptr, nullptr};
}

[[noreturn]] void refuse_uses(std::span<const Use> uses) {
  std::string nodes;
  for (const NodeId n : uses.front().key.nodes) {
    if (n >= 0) nodes += (nodes.empty() ? "" : ", ") + std::to_string(n);
  }
  const auto [first, second] = find_twins(uses);
  const std::string element = std::to_string(second != nullptr ? second->element : uses[2].element);
  std::string text = "element " + element;
  if (second != nullptr) {
    text += " is in the mesh twice, as element " + std::to_string(first->element) +
            "; the facet with the nodes " + nodes + " is used by " + std::to_string(uses.size()) +
            " elements";
  } else {
    text += ": its facet with the nodes " + nodes + " is used by " + std::to_string(uses.size()) +
            " elements (also by " + std::to_string(uses[0].element) + " and " +
            std::to_string(uses[1].element) + ")";
  }
  throw InvalidMesh("FACET_OVERUSED", text + "; a facet belongs to one or two elements",
                    {{"element", element}, {"facet_nodes", nodes}});
}

}  // namespace

void throw_overused_facet(const TopologyView& topology) {
  std::vector<Use> uses;
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    const std::size_t width = element_width(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e, ++element) {
      const ElementView view{&shape, &block.nodes[e * width]};
      for (int f = 0; f < shape.facet_count; ++f) {
        uses.push_back({facet_key(view, f), element, {view.nodes, width}});
      }
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return a.key == b.key ? a.element < b.element : a.key < b.key;
  });
  for (std::size_t first = 0, last; first < uses.size(); first = last) {
    for (last = first; last < uses.size() && uses[last].key == uses[first].key;) ++last;
    if (last - first > 2) refuse_uses(std::span(uses).subspan(first, last - first));
  }
  throw InvalidMesh("FACET_OVERUSED", "a facet is used by more than two elements");
}

void refuse_too_large(const TopologyView& topology) {
  if (topology.node_count > std::numeric_limits<NodeId>::max()) {
    throw NotSupported("MESH_TOO_LARGE", "a mesh has at most 2147483647 nodes, this one has " +
                                             std::to_string(topology.node_count));
  }
  if (topology.element_count() > std::numeric_limits<ElementId>::max()) {
    throw NotSupported("MESH_TOO_LARGE", "a mesh has at most 4294967295 elements, this one has " +
                                             std::to_string(topology.element_count()));
  }
}

void refuse_tangled(const QualityStats& quality, TangledPolicy policy) {
  if (quality.inverted_count == 0) return;
  if (policy == TangledPolicy::refuse) {
    const std::string inverted = std::to_string(quality.inverted_count);
    const std::string element = std::to_string(quality.worst.front().element);
    throw InvalidMesh("MESH_TANGLED",
                      inverted + " of " + std::to_string(quality.element_count) +
                          " elements are inverted, the worst is element " + element +
                          "; allow repair, or fix the mesh first",
                      {{"inverted_element_count", inverted}, {"element", element}});
  }
}

void refuse_tangled_reference(const QualityStats& quality) {
  const std::int64_t invalid = quality.inverted_count + quality.degenerate_count;
  if (invalid == 0) return;
  const std::string element = std::to_string(quality.worst.front().element);
  throw InvalidMesh(
      "REFERENCE_TANGLED",
      std::to_string(invalid) + " of " + std::to_string(quality.element_count) +
          " elements are inverted or flat before anything moves, the worst is element " + element +
          "; smooth the mesh first",
      {{"inverted_element_count", std::to_string(invalid)}, {"element", element}});
}

void refuse_moving_surface() {
  throw NotSupported(
      "OPTION_NOT_SUPPORTED",
      "move has no meaning on a curved surface mesh, whose nodes stay on it; it moves "
      "volume meshes and plane ones",
      {{"field", "method"}});
}

void refuse_flat_reference(std::int64_t flat_count, std::size_t element_count) {
  if (static_cast<std::size_t>(flat_count) < element_count) return;
  throw InvalidMesh("REFERENCE_FLAT",
                    "all " + std::to_string(element_count) +
                        " elements of the reference are flat or inverted; a reference has the same "
                        "nodes in the same order, in positions that are valid");
}

void refuse_surface_on(const TopologyView& topology, const JobInput& input) {
  if (input.surface == nullptr) return;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    const bool second_order =
        element_width(block.type) > static_cast<std::size_t>(shape.node_count);
    if (shape.dimension == 3 && !second_order) continue;
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       std::string("a target surface is for the boundary of first-order volume "
                                   "elements, the mesh has ") +
                           (second_order ? "elements of second order" : "surface elements"),
                       {{"field", "surface"}});
  }
}

void refuse_beyond_surfaces(Vec3d lower, Vec3d upper) {
  const double least = std::min({lower.x, lower.y, lower.z});
  const double most = std::max({upper.x, upper.y, upper.z});
  if (std::max(-least, most) <= kMostSurfaceCoordinate) return;
  throw InvalidMesh("SURFACE_INVALID",
                    "target surface: the mesh has coordinates beyond 1e60, whose distances from it "
                    "may be infinite");
}

}  // namespace meshsmooth::detail

#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/mesh.hpp"
#include "smooth/rules/topology.hpp"
#include "smooth/steps/executor.hpp"

namespace meshsmooth::detail {

/// The nodes of a facet in ascending order; missing ones are -1 and come first.
struct FacetKey {
  NodeId nodes[4];

  friend MESHSMOOTH_HD bool operator<(const FacetKey& a, const FacetKey& b) {
    for (int n = 0; n < 4; ++n) {
      if (a.nodes[n] != b.nodes[n]) return a.nodes[n] < b.nodes[n];
    }
    return false;
  }
  friend MESHSMOOTH_HD bool operator==(const FacetKey& a, const FacetKey& b) {
    return !(a < b) && !(b < a);
  }
};

MESHSMOOTH_HD inline FacetKey facet_key(const ElementView& element, int facet) {
  const FacetShape& shape = element.shape->facets[facet];
  FacetKey key{{-1, -1, -1, -1}};
  for (int n = 0; n < shape.node_count; ++n) {
    const NodeId node = element.nodes[shape.nodes[n]];
    int place = 4 - shape.node_count + n;
    for (; place > 0 && key.nodes[place - 1] > node; --place)
      key.nodes[place] = key.nodes[place - 1];
    key.nodes[place] = node;
  }
  return key;
}

/// Throws the `InvalidMesh` of a facet used more than twice. Called once something
/// is known to be wrong; O(elements log elements).
[[noreturn]] inline void throw_overused_facet(const TopologyView& topology) {
  struct Use {
    FacetKey key;
    std::size_t element;
  };
  std::vector<Use> uses;
  std::size_t element = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementShape& shape = element_shape(block.type);
    for (std::size_t e = 0; e < block.element_count(); ++e, ++element) {
      const ElementView view{&shape, &block.nodes[e * static_cast<std::size_t>(shape.node_count)]};
      for (int f = 0; f < shape.facet_count; ++f) uses.push_back({facet_key(view, f), element});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return a.key == b.key ? a.element < b.element : a.key < b.key;
  });
  for (std::size_t first = 0, last; first < uses.size(); first = last) {
    for (last = first; last < uses.size() && uses[last].key == uses[first].key;) ++last;
    if (last - first <= 2) continue;
    std::string nodes;
    for (const NodeId n : uses[first].key.nodes) {
      if (n >= 0) nodes += (nodes.empty() ? "" : ", ") + std::to_string(n);
    }
    const std::string third = std::to_string(uses[first + 2].element);
    throw InvalidMesh("FACET_OVERUSED",
                      "element " + third + ": its facet with the nodes " + nodes + " is used by " +
                          std::to_string(last - first) + " elements (also by " +
                          std::to_string(uses[first].element) + " and " +
                          std::to_string(uses[first + 1].element) +
                          "); a facet belongs to one or two elements",
                      {{"element", third}, {"facet_nodes", nodes}});
  }
  throw InvalidMesh("FACET_OVERUSED", "a facet is used by more than two elements");
}

/// The boundary, as in the paper: all facets sorted; one that stands alone
/// marks its nodes. Works on any executor and is the judge of the faster ways.
/// Source: Xiao et al. 2019, section 3.3.
///
/// gives  `on_boundary[node]` = 1 for nodes of facets used once, else 0; returns
///        whether no facet is used more than twice
/// cost   O(facets log facets), 16 B a facet of every element while it runs
template <Executor E>
[[nodiscard]] bool find_boundary_by_sorting(E& executor, std::size_t node_count,
                                            const Elements& elements, std::uint8_t* on_boundary) {
  auto first_key = executor.template allocate<std::int64_t>(elements.count + 1);
  std::int64_t* const first = first_key.data();
  executor.for_each(elements.count + 1, [=] MESHSMOOTH_HD(std::size_t e) {
    first[e] = e < elements.count ? elements[e].shape->facet_count : 0;
  });
  const auto count = static_cast<std::size_t>(executor.exclusive_scan(first, elements.count + 1));
  auto keys = executor.template allocate<FacetKey>(count);
  FacetKey* const key = keys.data();
  executor.for_each(elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = elements[e];
    for (int f = 0; f < element.shape->facet_count; ++f) key[first[e] + f] = facet_key(element, f);
  });
  executor.sort(key, count);
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) { on_boundary[node] = 0; });
  const bool overused = executor.reduce(
      count, false,
      [=] MESHSMOOTH_HD(std::size_t k) {
        const bool as_before = k > 0 && key[k - 1] == key[k];
        const bool as_after = k + 1 < count && key[k + 1] == key[k];
        if (!as_before && !as_after) {
          for (const NodeId node : key[k].nodes) {
            if (node >= 0) E::store(on_boundary[node], std::uint8_t{1});
          }
        }
        return as_before && as_after;
      },
      [] MESHSMOOTH_HD(bool a, bool b) { return a || b; });
  return !overused;
}

}  // namespace meshsmooth::detail

#include "meshsmooth/numbering.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mesh/curved_jacobian.hpp"
#include "mesh/facet_rows.hpp"
#include "mesh/parallel.hpp"
#include "mesh/same_direction.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {
namespace {

using detail::FacetUse;

bool same_direction(const FacetUse& a, const FacetUse& b) {
  return detail::same_direction(element_shape(a.type).facets[a.number], a.nodes,
                                element_shape(b.type).facets[b.number], b.nodes);
}

/// A pair of elements that share a facet.
struct Link {
  std::uint32_t a, b;  // ids
  bool same;           // direction: one of the two is mirrored against the other
};

/// Calls `take(link)` for every two elements that share a facet, in an order that depends on the
/// topology alone. The links of some nodes at a time are found by many threads and taken by one.
template <class Take>
void for_each_link(const TopologyView& topology, const std::function<void()>& check,
                   const Take& take) {
  constexpr std::size_t kNodes = std::size_t{1} << 16;
  const detail::FacetRows rows(topology, check);
  std::vector<std::vector<Link>> links;
  for (std::size_t begin = 0; begin < topology.node_count; begin += kNodes) {
    const std::size_t end = std::min(topology.node_count, begin + kNodes);
    check();
    constexpr std::size_t kTask = 1024;
    links.resize((end - begin + kTask - 1) / kTask);
    detail::parallel_for(links.size(), [&](std::size_t task) {
      links[task].clear();
      std::vector<FacetUse> row;
      const std::size_t first = begin + task * kTask;
      for (std::size_t node = first; node < std::min(end, first + kTask); ++node) {
        rows.visit_row(node, row, [&](std::span<const FacetUse> uses) {
          if (uses.size() != 2) return;
          links[task].push_back({static_cast<std::uint32_t>(uses[0].element),
                                 static_cast<std::uint32_t>(uses[1].element),
                                 same_direction(uses[0], uses[1])});
        });
      }
    });
    for (const auto& of_task : links) std::ranges::for_each(of_task, take);
  }
}

/// Components of elements, and which of them are mirrored against the first of their component:
/// a union-find whose links carry a parity.
class Components {
 public:
  explicit Components(std::size_t count) : parents_(count), odd_(count, 0) {
    std::iota(parents_.begin(), parents_.end(), 0U);
  }

  struct Place {
    std::uint32_t root;
    std::uint8_t odd;
  };

  /// With the path shortened to the root.
  Place find(std::uint32_t element) {
    std::uint32_t root = element;
    std::uint8_t odd = 0;
    for (; parents_[root] != root; root = parents_[root]) odd ^= odd_[root];
    const Place found{root, odd};
    while (parents_[element] != root) {
      const std::uint32_t next = std::exchange(parents_[element], root);
      odd ^= std::exchange(odd_[element], odd);
      element = next;
    }
    return found;
  }

  /// Returns false where the two are of one component whose parities contradict the link.
  bool join(const Link& link) {
    const Place a = find(link.a);
    const Place b = find(link.b);
    const auto odd = static_cast<std::uint8_t>(a.odd ^ b.odd ^ (link.same ? 1 : 0));
    if (a.root == b.root) return odd == 0;
    const auto [low, high] = std::minmax(a.root, b.root);
    parents_[high] = low;
    odd_[high] = odd;
    return true;
  }

 private:
  std::vector<std::uint32_t> parents_;
  std::vector<std::uint8_t> odd_;  // against the parent
};

/// What an element adds to the decision on the sign of its component.
struct Weight {
  double volume = 0;  // signed; of a surface element that of the cone to the first node
  double absolute = 0;
  Vec3d area{0, 0, 0};  // of a surface element
};

Weight weigh(ElementType linear, const Vec3d* at, Vec3d origin) {
  if (element_shape(linear).dimension == 3) {
    const double volume = measure_element(linear, at, {0, 0, 0}).volume;
    return {volume, std::abs(volume), {0, 0, 0}};
  }
  const Vec3d area = linear == ElementType::triangle ? cross(at[1] - at[0], at[2] - at[0])
                                                     : cross(at[2] - at[0], at[3] - at[1]);
  return {dot(area, at[0] - origin), norm(area), area};
}

/// Calls `take(element, weight)` in the order of the elements. Those of some elements at a time are
/// found by many threads and taken by one.
template <class Real, class Take>
void for_each_weight(const TopologyView& topology, std::span<const Vec3<Real>> positions,
                     const Take& take) {
  constexpr std::size_t kElements = std::size_t{1} << 16;
  const Vec3d origin =
      vec3_cast<double>(positions[static_cast<std::size_t>(topology.blocks.front().nodes.front())]);
  std::vector<Weight> weights;
  std::size_t first = 0;
  for (const ElementBlockView& block : topology.blocks) {
    const ElementType type = linear_type(block.type);
    const std::size_t width = element_width(block.type);
    const std::size_t count = block.element_count();
    for (std::size_t begin = 0; begin < count; begin += kElements) {
      weights.resize(std::min(kElements, count - begin));
      detail::parallel_for_ranges(weights.size(), [&](std::size_t from, std::size_t to) {
        for (std::size_t e = from; e < to; ++e) {
          const std::span<const NodeId> corners(&block.nodes[(begin + e) * width],
                                                element_width(type));
          weights[e] = weigh(type, detail::positions_of(corners, positions).data(), origin);
        }
      });
      for (std::size_t e = 0; e < weights.size(); ++e) take(first + begin + e, weights[e]);
    }
    first += count;
  }
}

/// A component, each element counted as it is numbered against the first of them.
struct Component {
  Weight sum;
  std::size_t even = 0, odd = 0;
  std::size_t negative = 0;  // volumes

  void add(const Weight& weight, bool is_odd) {
    const double sign = is_odd ? -1 : 1;
    sum.volume += sign * weight.volume;
    sum.area += sign * weight.area;
    sum.absolute += weight.absolute;
    ++(is_odd ? odd : even);
    if (sign * weight.volume < 0) ++negative;
  }

  /// Whether the elements that are numbered like the first are mirrored. What cancels but for
  /// rounding decides nothing. Of a surface every side is right, unless it is closed; so that the
  /// answer does not depend on which elements are mirrored, it is the one along the first axis of
  /// those that its normal is nearest to.
  [[nodiscard]] bool turned(bool volume) const {
    constexpr double kRounding = 1e-9;
    if (volume) {
      // One that is numbered alike is tangled, not mirrored, unless most of its elements say so.
      const bool most = 2 * negative > even + odd;
      return sum.volume < -kRounding * sum.absolute && (most || (even > 0 && odd > 0));
    }
    double along = 0;
    for (const double part : {sum.area.x, sum.area.y, sum.area.z}) {
      if (std::abs(part) > (1 + kRounding) * std::abs(along)) along = part;
    }
    return std::abs(along) > kRounding * sum.absolute ? along < 0 : sum.volume < 0;
  }
};

}  // namespace

Numbering find_numbering(const TopologyView& topology, const PositionsView& positions,
                         const std::function<void()>& check) {
  Numbering result;
  const std::size_t count = topology.element_count();
  Components components(count);
  for_each_link(topology, check, [&](const Link& link) {
    if (!components.join(link)) ++result.cut_facet_count;
  });
  constexpr auto kUnseen = static_cast<std::uint32_t>(-1);
  std::vector<std::uint32_t> index_of(count, kUnseen);  // of each root
  std::vector<Component> found;
  check();
  std::visit(
      [&](const auto& span) {
        for_each_weight(topology, span, [&](std::size_t e, const Weight& weight) {
          const auto [root, odd] = components.find(static_cast<std::uint32_t>(e));
          if (index_of[root] == kUnseen) {
            index_of[root] = static_cast<std::uint32_t>(found.size());
            found.emplace_back();
          }
          found[index_of[root]].add(weight, odd != 0);
        });
      },
      positions);
  const bool volume = element_shape(topology.blocks.front().type).dimension == 3;
  const bool curved = !volume && !SurfaceOrientation(topology, positions).plane();
  result.mirrored.resize(count);
  for (std::size_t e = 0; e < count; ++e) {
    const auto [root, odd] = components.find(static_cast<std::uint32_t>(e));
    const Component& component = found[index_of[root]];
    const bool mixed = component.odd > 0;
    const bool mirrored = (mixed || !curved) && (odd != 0) != component.turned(volume);
    result.mirrored[e] = mirrored ? 1 : 0;
    result.mirrored_count += result.mirrored[e];
  }
  // A surface whose elements are all numbered alike has no wrong side.
  if (!volume && static_cast<std::size_t>(result.mirrored_count) == count)
    result.mirrored_count = 0;
  if (result.mirrored_count == 0) result.mirrored.clear();
  return result;
}

}  // namespace meshsmooth

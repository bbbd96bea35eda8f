#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "mesh/canonical/interface_element.hpp"
#include "mesh/same_direction.hpp"
#include "meshsmooth/element_geometry.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Ends a job on a mesh that may not be canonical (see canonical_topology.hpp): it starts anew on a
/// topology that is. Not an error, so not one of the caller's exceptions.
struct NotCanonical {};

/// Whether an element may be mirrored, or is an interface.
template <class Real>
struct NotCanonicalRule {
  // Balls longer than this are left to the host, which sorts: a search there is quadratic.
  static constexpr std::size_t kLongBall = 512;
  // Elements around an inverted one whose volumes are summed.
  static constexpr int kMostAround = 8;

  enum Answer : std::int32_t { canonical, in_doubt, not_canonical };

  Elements elements;
  Rows<ElementId> balls;
  const Vec3<Real>* positions;
  Vec3d reference;                 // of plane elements; zero otherwise
  bool curved;                     // a curved surface
  bool encloses_positive = false;  // each part of the mesh is known to

  [[nodiscard]] MESHSMOOTH_HD double volume_of(const ElementView& element) const {
    const auto get = [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); };
    return element_volume(*element.shape, get, reference);
  }
  [[nodiscard]] MESHSMOOTH_HD bool inverted(const ElementView& element) const {
    return volume_of(element) < 0;
  }

  /// What lies beyond a facet of an element.
  struct Beyond {
    std::size_t element = 0;
    int count = 0;              // of elements that share it; `element` is the last of them
    bool same = false;          // direction: one of the two is mirrored against the other
    bool in_long_ball = false;  // then nothing else is known
  };
  [[nodiscard]] MESHSMOOTH_HD Beyond find_beyond(std::size_t e, int f) const {
    const ElementView element = elements[e];
    const FacetShape& facet = element.shape->facets[f];
    NodeId node = element.nodes[facet.nodes[0]];
    for (int n = 1; n < facet.node_count; ++n) {
      const NodeId other = element.nodes[facet.nodes[n]];
      if (balls.size(other) < balls.size(node)) node = other;
    }
    Beyond beyond;
    beyond.in_long_ball = balls.size(node) > kLongBall;
    if (beyond.in_long_ball) return beyond;
    const FacetKey key = facet_key(element, f);
    for (const ElementId* b = balls.begin(node); b != balls.end(node); ++b) {
      if (*b == e) continue;
      const ElementView other = elements[*b];
      for (int g = 0; g < other.shape->facet_count; ++g) {
        if (other.shape->facets[g].node_count != facet.node_count) continue;
        if (!(facet_key(other, g) == key)) continue;
        beyond.same = same_direction(facet, element.nodes, other.shape->facets[g], other.nodes);
        beyond.element = *b;
        ++beyond.count;
      }
    }
    return beyond;
  }

  /// An inverted element is mirrored if its neighbours tell so, and may be if the elements around
  /// it enclose a negative volume, as in a component that is mirrored as a whole. On a curved
  /// surface nothing is inverted, but neighbours tell. A facet of three and more elements tells
  /// nothing, as in `find_numbering`.
  [[nodiscard]] MESHSMOOTH_HD Answer operator()(std::size_t e) const {
    const ElementView element = elements[e];
    const auto get = [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); };
    if (is_interface(*element.shape, get)) return not_canonical;
    if (!curved && !inverted(element)) return canonical;
    int neighbour_count = 0, inverted_count = 0;
    for (int f = 0; f < element.shape->facet_count; ++f) {
      const Beyond beyond = find_beyond(e, f);
      if (beyond.in_long_ball) return not_canonical;
      if (beyond.count != 1) continue;
      if (beyond.same) return not_canonical;
      ++neighbour_count;
      if (!curved && inverted(elements[beyond.element])) ++inverted_count;
    }
    if (curved || encloses_positive || 2 * inverted_count < neighbour_count) return canonical;
    return element.shape->dimension == 2 ? not_canonical : look_around(e);
  }

  /// By the sum of the volumes of the elements that facets connect to one, from the nearest on:
  /// what their common boundary encloses, to which the nodes between them add nothing.
  [[nodiscard]] MESHSMOOTH_HD Answer look_around(std::size_t e) const {
    ElementId around[kMostAround];
    around[0] = static_cast<ElementId>(e);
    int count = 1;
    double volume = volume_of(elements[e]);
    for (int next = 0; next < count; ++next) {
      const int facet_count = elements[around[next]].shape->facet_count;
      for (int f = 0; f < facet_count; ++f) {
        const Beyond beyond = find_beyond(around[next], f);
        if (beyond.in_long_ball) return not_canonical;
        if (beyond.count != 1) continue;
        const auto found = static_cast<ElementId>(beyond.element);
        bool known = false;
        for (int k = 0; k < count && !known; ++k) known = around[k] == found;
        if (known) continue;
        around[count++] = found;
        volume += volume_of(elements[found]);
        if (count == kMostAround) return volume < 0 ? in_doubt : canonical;
      }
    }
    return volume < 0 ? not_canonical : canonical;
  }
};

/// Bytes that `encloses_negative_volume` holds while it runs: on volume meshes.
[[nodiscard]] inline std::int64_t enclosed_volume_bytes(const MeshCounts& mesh) {
  return mesh.dimension == 3 ? mesh.nodes * 2 * static_cast<std::int64_t>(sizeof(float)) : 0;
}

/// An element's volume.
template <class Real>
struct OwnVolume {
  NotCanonicalRule<Real> rule;

  MESHSMOOTH_HD double operator()(const ElementView& element) const {
    return rule.volume_of(element);
  }
};

/// The sum of what an element's nodes have for each of their elements.
struct PartsOfNodes {
  const float* volumes;
  Rows<ElementId> balls;

  MESHSMOOTH_HD double operator()(const ElementView& element) const {
    double sum = 0;
    for (int n = 0; n < element.shape->node_count; ++n) {
      const auto node = static_cast<std::size_t>(element.nodes[n]);
      sum += volumes[node] / static_cast<double>(balls.size(node));
    }
    return sum;
  }
};

/// Gives each node an equal share of what `volume` says of each of its elements.
template <Executor E, class Volume>
void share_among_nodes(E& executor, Elements elements, Rows<ElementId> balls, Volume volume,
                       float* to, std::size_t node_count) {
  executor.for_each(node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    double sum = 0;
    for (const ElementId* e = balls.begin(node); e != balls.end(node); ++e) {
      const ElementView element = elements[*e];
      sum += volume(element) / element.shape->node_count;
    }
    to[node] = static_cast<float>(sum);
  });
}

/// Whether elements enclose a negative volume somewhere. Each node gets an equal share of its
/// elements' volumes, which is spread to nodes nearby: this changes no sum over a component, so
/// where a component is mirrored some node is left with less than 0. Where a valid numbering is
/// tangled none is, since what a patch encloses depends on its boundary alone: of cubes of 5,000 to
/// a million nodes, 45 % of their elements inverted, none after two rounds.
///
/// cost  O(ball entries), `enclosed_volume_bytes`
template <Executor E, class Real>
[[nodiscard]] bool encloses_negative_volume(E& executor, const NotCanonicalRule<Real>& rule,
                                            std::size_t node_count) {
  constexpr int kRounds = 4;
  auto volumes = executor.template allocate<float>(node_count);
  auto spread = executor.template allocate<float>(node_count);
  share_among_nodes(executor, rule.elements, rule.balls, OwnVolume<Real>{rule}, volumes.data(),
                    node_count);
  for (int round = 0; round < kRounds; ++round) {
    share_among_nodes(executor, rule.elements, rule.balls, PartsOfNodes{volumes.data(), rule.balls},
                      spread.data(), node_count);
    std::swap(volumes, spread);
  }
  const float* const left = volumes.data();
  return executor.reduce(
             node_count, std::int64_t{0},
             [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t { return left[node] < 0 ? 1 : 0; },
             Plus{}) > 0;
}

/// Whether the mesh may not be canonical. What is not canonical has inverted or degenerate
/// elements, or is a curved surface: other meshes are not examined.
///
/// cost   O(ball entries) around the inverted elements, `enclosed_volume_bytes`
template <Executor E, class Real, class Orientation>
[[nodiscard]] bool may_not_be_canonical(E& executor, const JobMesh<E, Real>& job,
                                        const Orientation& orientation) {
  if (job.balls.offsets.data() == nullptr) return true;  // the backend has no use for them
  using Rule = NotCanonicalRule<Real>;
  Rule rule{job.elements.view, job.balls.view(), job.positions.data(), orientation.common(),
            orientation.references() != nullptr};
  // In parts, each larger than the one before: where elements are mirrored many are, of which the
  // first few tell.
  constexpr std::size_t kFirstPart = 64;
  constexpr std::int64_t kMany = std::int64_t{1} << 32;  // more than there are in doubt
  const std::size_t count = job.elements.view.count;
  for (std::size_t first = 0, part = kFirstPart; first < count; first += part, part *= 8) {
    const std::int64_t found = executor.reduce(
        std::min(part, count - first), std::int64_t{0},
        [=] MESHSMOOTH_HD(std::size_t n) -> std::int64_t {
          const typename Rule::Answer answer = rule(first + n);
          return answer == Rule::not_canonical ? kMany : answer == Rule::in_doubt ? 1 : 0;
        },
        Plus{});
    if (found >= kMany) return true;
    if (found == 0) continue;
    if (encloses_negative_volume(executor, rule, job.node_count)) return true;
    rule.encloses_positive = true;
  }
  return false;
}

}  // namespace meshsmooth::detail

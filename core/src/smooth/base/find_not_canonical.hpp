#pragma once

#include "mesh/canonical/interface_element.hpp"
#include "mesh/same_direction.hpp"
#include "meshsmooth/element_geometry.hpp"
#include "smooth/base/job_mesh.hpp"

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
  static constexpr int kMostAround = 512;

  Elements elements;
  Rows<ElementId> balls;
  const Vec3<Real>* positions;
  Vec3d reference;  // of plane elements; zero otherwise
  bool curved;      // a curved surface

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
  [[nodiscard]] MESHSMOOTH_HD bool operator()(std::size_t e) const {
    const ElementView element = elements[e];
    const auto get = [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); };
    if (is_interface(*element.shape, get)) return true;
    if (!curved && !inverted(element)) return false;
    int neighbour_count = 0, inverted_count = 0;
    for (int f = 0; f < element.shape->facet_count; ++f) {
      const Beyond beyond = find_beyond(e, f);
      if (beyond.in_long_ball) return true;
      if (beyond.count != 1) continue;
      if (beyond.same) return true;
      ++neighbour_count;
      if (!curved && inverted(elements[beyond.element])) ++inverted_count;
    }
    if (curved || 2 * inverted_count < neighbour_count) return false;
    return element.shape->dimension == 2 || encloses_negative_volume(e);
  }

  /// Of the elements that facets connect to one, from the nearest on: the sum of their volumes is
  /// what their common boundary encloses, to which their inner nodes add nothing. It is negative
  /// around some element of a component that is mirrored as a whole. Where a valid numbering is
  /// tangled it soon becomes positive: of 6.6 million tetrahedra, 40 % of them inverted, around
  /// every one within 256 elements.
  [[nodiscard]] MESHSMOOTH_HD bool encloses_negative_volume(std::size_t e) const {
    ElementId around[kMostAround];
    around[0] = static_cast<ElementId>(e);
    int count = 1, next_look = 8;
    double volume = volume_of(elements[e]);
    for (int next = 0; next < count; ++next) {
      const int facet_count = elements[around[next]].shape->facet_count;
      for (int f = 0; f < facet_count; ++f) {
        const Beyond beyond = find_beyond(around[next], f);
        if (beyond.in_long_ball) return true;
        if (beyond.count != 1) continue;
        const auto found = static_cast<ElementId>(beyond.element);
        bool known = false;
        for (int k = 0; k < count && !known; ++k) known = around[k] == found;
        if (known) continue;
        around[count++] = found;
        volume += volume_of(elements[found]);
        if (count < next_look) continue;
        if (volume >= 0) return false;
        if (count == kMostAround) return true;
        next_look *= 2;
      }
    }
    return volume < 0;
  }
};

/// Whether the mesh may not be canonical. What is not canonical has inverted or degenerate
/// elements, or is a curved surface: other meshes are not examined.
///
/// cost   O(ball entries) around the inverted elements
template <Executor E, class Real, class Orientation>
[[nodiscard]] bool may_not_be_canonical(E& executor, const JobMesh<E, Real>& job,
                                        const Orientation& orientation) {
  if (job.balls.offsets.data() == nullptr) return true;  // the backend has no use for them
  const NotCanonicalRule<Real> rule{job.elements.view, job.balls.view(), job.positions.data(),
                                    orientation.common(), orientation.references() != nullptr};
  return executor.reduce(
             job.elements.view.count, std::int64_t{0},
             [=] MESHSMOOTH_HD(std::size_t e) -> std::int64_t { return rule(e) ? 1 : 0; },
             Plus{}) > 0;
}

}  // namespace meshsmooth::detail

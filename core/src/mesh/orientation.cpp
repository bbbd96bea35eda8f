// The reference normals of surface meshes.

#include <functional>
#include <limits>

#include "mesh/parallel.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth {
namespace {

/// Twice the area vector of a triangle or quad.
template <class Real>
Vec3d area_vector(std::span<const Vec3<Real>> positions, ElementType type, const NodeId* nodes) {
  const auto at = [&](int n) {
    return vec3_cast<double>(positions[static_cast<std::size_t>(nodes[n])]);
  };
  return linear_type(type) == ElementType::triangle ? cross(at(1) - at(0), at(2) - at(0))
                                                    : cross(at(2) - at(0), at(3) - at(1));
}

/// The greatest `value(node)` over all nodes of elements, 0 if none is greater,
/// and where it first occurs.
struct Farthest {
  double value = 0;
  std::size_t entry = std::numeric_limits<std::size_t>::max();
};

template <class Value>
Farthest find_farthest(std::span<const NodeId> nodes, const Value& value) {
  return detail::parallel_reduce(
      nodes.size(), Farthest{},
      [&](std::size_t i) {
        return Farthest{value(nodes[i]), i};
      },
      [](Farthest a, Farthest b) { return b.value > a.value ? b : a; });
}

template <class Value>
Farthest find_farthest(const TopologyView& topology, NodeId& node, const Value& value) {
  Farthest best;
  for (const ElementBlockView& block : topology.blocks) {
    const Farthest here = find_farthest(block.nodes, value);
    if (here.value > best.value) {
      best = here;
      node = block.nodes[here.entry];
    }
  }
  return best;
}

/// Unit normal of the plane in which all elements lie, or zero.
template <class Real>
Vec3d find_plane(const TopologyView& topology, std::span<const Vec3<Real>> positions) {
  const auto at = [&](NodeId node) {
    return vec3_cast<double>(positions[static_cast<std::size_t>(node)]);
  };
  NodeId first = 0;
  for (const ElementBlockView& block : topology.blocks) {
    if (block.nodes.empty()) continue;
    first = block.nodes.front();
    break;
  }
  const Vec3d origin = at(first);
  NodeId second = first, third = first;
  const double length =
      find_farthest(topology, second, [&](NodeId node) { return norm(at(node) - origin); }).value;
  if (!(length > 0)) return {0, 0, 0};
  const Vec3d along = (1 / length) * (at(second) - origin);
  find_farthest(topology, third,
                [&](NodeId node) { return norm(cross(along, at(node) - origin)); });
  const Vec3d across = cross(along, at(third) - origin);
  if (!(norm(across) > 0)) return {0, 0, 0};
  const Vec3d normal = (1 / norm(across)) * across;

  // The coordinates themselves are rounded, which dominates in float32.
  NodeId outermost = first;
  const double magnitude = norm(origin) + find_farthest(topology, outermost, [&](NodeId node) {
                                            return norm(at(node));
                                          }).value;
  const double tolerance = 1e-12 * length + 4 * std::numeric_limits<Real>::epsilon() * magnitude;
  const double deviation = find_farthest(topology, outermost, [&](NodeId node) {
                             return std::abs(dot(normal, at(node) - origin));
                           }).value;
  return deviation <= tolerance ? normal : Vec3d{0, 0, 0};
}

/// Sum of the elements' areas projected along `normal`. Only its sign matters, so the grouping of
/// the sum is fixed but arbitrary.
template <class Real>
double sum_areas(const ElementBlockView& block, std::span<const Vec3<Real>> positions,
                 Vec3d normal) {
  const auto width = element_width(block.type);
  return detail::parallel_reduce(
      block.element_count(), 0.0,
      [&](std::size_t e) {
        return dot(normal, area_vector(positions, block.type, &block.nodes[e * width]));
      },
      std::plus<>());
}

template <class Real>
void find_normals(const TopologyView& topology, std::span<const Vec3<Real>> positions,
                  std::vector<PackedDirection>& normals) {
  normals.resize(topology.element_count());
  PackedDirection* first = normals.data();
  for (const ElementBlockView& block : topology.blocks) {
    const auto width = element_width(block.type);
    detail::parallel_for_ranges(block.element_count(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t e = begin; e != end; ++e) {
        const Vec3d area = area_vector(positions, block.type, &block.nodes[e * width]);
        const double size = norm(area);
        first[e] = pack_direction(size > 0 ? (1 / size) * area : Vec3d{0, 0, 0});
      }
    });
    first += block.element_count();
  }
}

}  // namespace

SurfaceOrientation::SurfaceOrientation(const TopologyView& topology,
                                       const PositionsView& positions) {
  if (topology.blocks.empty() || element_shape(topology.blocks.front().type).dimension != 2) return;
  std::visit(
      [&]<class Real>(std::span<const Vec3<Real>> span) {
        common_ = find_plane(topology, span);
        plane_ = !(common_ == Vec3d{0, 0, 0});
        if (!plane_) return find_normals(topology, span, normals_);
        double area = 0;
        for (const ElementBlockView& block : topology.blocks) {
          area += sum_areas(block, span, common_);
        }
        if (area < 0) common_ = -1.0 * common_;
      },
      positions);
}

}  // namespace meshsmooth

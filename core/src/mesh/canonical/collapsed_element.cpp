#include "mesh/canonical/collapsed_element.hpp"

#include <algorithm>
#include <vector>

namespace meshsmooth::detail {
namespace {

/// A facet without repeated neighbours: 3 or 4 nodes, or fewer where it has become an edge.
using Face = std::vector<NodeId>;

Face face_of(const FacetShape& facet, std::span<const NodeId> nodes) {
  Face face;
  for (int n = 0; n < facet.node_count; ++n) {
    const NodeId node = nodes[static_cast<std::size_t>(facet.nodes[n])];
    if (face.empty() || face.back() != node) face.push_back(node);
  }
  while (face.size() > 1 && face.front() == face.back()) face.pop_back();
  return face;
}

/// The same cycle, from its lowest node on.
Face from_lowest(Face face) {
  std::rotate(face.begin(), std::ranges::min_element(face), face.end());
  return face;
}

/// The faces of an element, those that have become edges left out, in a normal form; empty where
/// one touches itself.
std::vector<Face> faces_of(const ElementShape& shape, std::span<const NodeId> nodes) {
  std::vector<Face> faces;
  for (int f = 0; f < shape.facet_count; ++f) {
    Face face = face_of(shape.facets[f], nodes);
    if (face.size() < 3) continue;
    Face sorted = face;
    std::ranges::sort(sorted);
    if (std::ranges::adjacent_find(sorted) != sorted.end()) return {};
    faces.push_back(from_lowest(std::move(face)));
  }
  return faces;
}

bool same_faces(std::vector<Face> a, std::vector<Face> b) {
  std::ranges::sort(a);
  std::ranges::sort(b);
  return a == b;
}

/// The node that shares an edge with `node` and is not on `base`; -1 where there is not just one.
NodeId across_from(const std::vector<Face>& faces, const Face& base, NodeId node) {
  NodeId found = -1;
  for (const Face& face : faces) {
    for (std::size_t n = 0; n < face.size(); ++n) {
      const NodeId next = face[(n + 1) % face.size()];
      const NodeId other = face[n] == node ? next : next == node ? face[n] : -1;
      if (other < 0 || std::ranges::find(base, other) != base.end()) continue;
      if (found >= 0 && found != other) return -1;
      found = other;
    }
  }
  return found;
}

/// The corners of the type that the faces form.
std::optional<PlainElement> corners_of(const std::vector<Face>& faces) {
  const auto quads = std::ranges::count_if(faces, [](const Face& f) { return f.size() == 4; });
  const auto triangles = static_cast<std::ptrdiff_t>(faces.size()) - quads;
  PlainElement result{};
  std::size_t corners_of_base = 3;
  if (triangles == 4 && quads == 0) {
    result.type = ElementType::tetrahedron;
  } else if (triangles == 4 && quads == 1) {
    result.type = ElementType::pyramid;
    corners_of_base = 4;
  } else if (triangles == 2 && quads == 3) {
    result.type = ElementType::wedge;
  } else {
    return std::nullopt;
  }
  const ElementShape& shape = element_shape(result.type);
  const auto base =
      std::ranges::find(faces, corners_of_base, [](const Face& face) { return face.size(); });
  // The facet of the type that is its base: the tetrahedron's without its last node, the first one
  // of the others.
  const FacetShape& facet = shape.facets[result.type == ElementType::tetrahedron ? 3 : 0];
  for (std::size_t n = 0; n < base->size(); ++n) {
    result.nodes[static_cast<std::size_t>(facet.nodes[n])] = (*base)[n];
  }
  if (result.type == ElementType::wedge) {
    for (std::size_t n = 0; n < 3; ++n) {
      result.nodes[n + 3] = across_from(faces, *base, result.nodes[n]);
    }
  } else {
    const NodeId apex = across_from(faces, *base, base->front());
    result.nodes[corners_of_base] = apex;
  }
  const auto nodes = std::span(result.nodes).first(static_cast<std::size_t>(shape.node_count));
  if (std::ranges::find(nodes, -1) != nodes.end()) return std::nullopt;
  return same_faces(faces_of(shape, nodes), faces) ? std::optional(result) : std::nullopt;
}

/// The type of second order with these corners that has nodes in the middle of edges alone.
std::optional<ElementType> second_order_type(ElementType linear) {
  for (const ElementType type : kElementTypes) {
    if (!is_second_order(type) || linear_type(type) != linear) continue;
    const auto mids = mid_nodes(type);
    if (std::ranges::all_of(mids, [](const MidNode& m) { return m.corner_count == 2; })) {
      return type;
    }
  }
  return std::nullopt;
}

/// Fills in the nodes in the middle of the edges; false where they contradict each other, or would
/// be lost.
bool add_mid_nodes(ElementType from, std::span<const NodeId> nodes, PlainElement& to) {
  const auto corner_count = static_cast<std::size_t>(element_shape(from).node_count);
  const auto mids = mid_nodes(from);
  struct Edge {
    NodeId low, high, mid;
  };
  std::vector<Edge> edges;
  for (std::size_t m = 0; m < mids.size(); ++m) {
    if (mids[m].corner_count != 2) return false;
    const auto [low, high] = std::minmax(nodes[static_cast<std::size_t>(mids[m].corners[0])],
                                         nodes[static_cast<std::size_t>(mids[m].corners[1])]);
    const NodeId mid = nodes[corner_count + m];
    if (low == high && mid != low) return false;
    edges.push_back({low, high, mid});
  }
  const auto type = second_order_type(to.type);
  if (!type) return false;
  to.type = *type;
  const auto own_mids = mid_nodes(*type);
  const auto own_corners = static_cast<std::size_t>(element_shape(*type).node_count);
  for (std::size_t m = 0; m < own_mids.size(); ++m) {
    const auto [low, high] =
        std::minmax(to.nodes[static_cast<std::size_t>(own_mids[m].corners[0])],
                    to.nodes[static_cast<std::size_t>(own_mids[m].corners[1])]);
    NodeId found = -1;
    for (const Edge& edge : edges) {
      if (edge.low != low || edge.high != high) continue;
      if (found >= 0 && found != edge.mid) return false;
      found = edge.mid;
    }
    if (found < 0) return false;
    to.nodes[own_corners + m] = found;
  }
  return true;
}

}  // namespace

bool repeats_nodes(std::span<const NodeId> nodes) {
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    for (std::size_t earlier = 0; earlier < n; ++earlier) {
      if (nodes[earlier] == nodes[n]) return true;
    }
  }
  return false;
}

std::optional<PlainElement> expand(ElementType type, std::span<const NodeId> nodes) {
  const ElementShape& shape = element_shape(type);
  const auto corners = nodes.first(static_cast<std::size_t>(shape.node_count));
  std::optional<PlainElement> result;
  if (shape.dimension == 2) {
    FacetShape outline{shape.node_count, {0, 1, 2, 3}};
    const Face face = face_of(outline, corners);
    if (shape.node_count != 4 || face.size() != 3) return std::nullopt;
    result = PlainElement{ElementType::triangle, {face[0], face[1], face[2]}};
    if (repeats_nodes(result->list())) return std::nullopt;
  } else {
    result = corners_of(faces_of(shape, corners));
  }
  if (result && is_second_order(type) && !add_mid_nodes(type, nodes, *result)) return std::nullopt;
  return result && !repeats_nodes(result->list()) ? result : std::nullopt;
}

}  // namespace meshsmooth::detail

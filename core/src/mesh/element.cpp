#include "meshsmooth/element.hpp"

#include <algorithm>

namespace meshsmooth {
namespace {

constexpr double kRoot2 = 1.41421356237309504880;
constexpr double kRoot3 = 1.73205080756887729353;
constexpr double kRoot6 = 2.44948974278317809820;

// Ideal corners, written as inverses of W = (w1 w2 w3), the ideal edge vectors
// of a corner as columns.

// w1 = (1, 0), w2 = (1/2, root3/2).
constexpr IdealCorner kEquilateral = {{{{1, -1 / kRoot3, 0}, {0, 2 / kRoot3, 0}, {0, 0, 1}}},
                                      kRoot3 / 2};

constexpr IdealCorner kSquare = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1};

// w3 = (1/2, root3/6, root6/3): the regular tetrahedron.
constexpr IdealCorner kRegularTetrahedron = {
    {{{1, -1 / kRoot3, -1 / kRoot6}, {0, 2 / kRoot3, -1 / kRoot6}, {0, 0, 3 / kRoot6}}},
    1 / kRoot2};

// w1 = (1, 0, 0), w2 = (0, 1, 0), w3 = (1/2, 1/2, 1/root2): unit square base,
// all edges equal.
constexpr IdealCorner kEqualEdgedPyramid = {
    {{{1, 0, -1 / kRoot2}, {0, 1, -1 / kRoot2}, {0, 0, kRoot2}}}, 1 / kRoot2};

// The equilateral triangle and a unit edge upright on it.
constexpr IdealCorner kUprightWedge = kEquilateral;

constexpr IdealCorner kCube = kSquare;

// name, dimension, nodes, edges, facets, corners; then the lists in this order.
// clang-format off
constexpr std::array<ElementShape, kLinearTypeCount> kTable = {{
    {"triangle", 2, 3, 3, 3, 3,
     {{{0, 1}, {1, 2}, {2, 0}}},
     {{{2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}}},
     {{{0, {1, 2}}, {1, {2, 0}}, {2, {0, 1}}}},
     kEquilateral},
    {"quad", 2, 4, 4, 4, 4,
     {{{0, 1}, {1, 2}, {2, 3}, {3, 0}}},
     {{{2, {0, 1}}, {2, {1, 2}}, {2, {2, 3}}, {2, {3, 0}}}},
     {{{0, {1, 3}}, {1, {2, 0}}, {2, {3, 1}}, {3, {0, 2}}}},
     kSquare},
    {"tetrahedron", 3, 4, 6, 4, 4,
     {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}},
     {{{3, {0, 1, 3}}, {3, {1, 2, 3}}, {3, {2, 0, 3}}, {3, {0, 2, 1}}}},
     {{{0, {1, 2, 3}}, {1, {2, 0, 3}}, {2, {0, 1, 3}}, {3, {0, 2, 1}}}},
     kRegularTetrahedron},
    {"pyramid", 3, 5, 8, 5, 4,
     {{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}},
     {{{4, {0, 3, 2, 1}}, {3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}}},
     {{{0, {1, 3, 4}}, {1, {2, 0, 4}}, {2, {3, 1, 4}}, {3, {0, 2, 4}}}},
     kEqualEdgedPyramid},
    {"wedge", 3, 6, 9, 5, 6,
     {{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}},
     {{{3, {0, 1, 2}}, {3, {3, 5, 4}}, {4, {0, 3, 4, 1}}, {4, {1, 4, 5, 2}}, {4, {2, 5, 3, 0}}}},
     {{{0, {2, 1, 3}}, {1, {0, 2, 4}}, {2, {1, 0, 5}}, {3, {4, 5, 0}}, {4, {5, 3, 1}},
       {5, {3, 4, 2}}}},
     kUprightWedge},
    {"hexahedron", 3, 8, 12, 6, 8,
     {{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6},
       {3, 7}}},
     {{{4, {0, 4, 7, 3}}, {4, {1, 2, 6, 5}}, {4, {0, 1, 5, 4}}, {4, {3, 7, 6, 2}},
       {4, {0, 3, 2, 1}}, {4, {4, 5, 6, 7}}}},
     {{{0, {1, 3, 4}}, {1, {2, 0, 5}}, {2, {3, 1, 6}}, {3, {0, 2, 7}}, {4, {7, 5, 0}},
       {5, {4, 6, 1}}, {6, {5, 7, 2}}, {7, {6, 4, 3}}}},
     kCube},
}};
// clang-format on

constexpr int edges_at(const ElementShape& shape, int node) {
  return static_cast<int>(
      std::count_if(shape.edges.begin(), shape.edges.begin() + shape.edge_count,
                    [&](const auto& edge) { return edge[0] == node || edge[1] == node; }));
}
constexpr int facets_at(const ElementShape& shape, int node) {
  return static_cast<int>(std::count_if(
      shape.facets.begin(), shape.facets.begin() + shape.facet_count, [&](const FacetShape& facet) {
        const auto end = facet.nodes.begin() + facet.node_count;
        return std::find(facet.nodes.begin(), end, node) != end;
      }));
}

constexpr bool keeps_limits(const ElementShape& shape) {
  if (shape.node_count > kMaxCorners || shape.facet_count > kMaxElementFacets) return false;
  for (int node = 0; node < shape.node_count; ++node) {
    if (edges_at(shape, node) > kMaxNodeEdges || facets_at(shape, node) > kMaxNodeFacets) {
      return false;
    }
  }
  // Facets have two nodes (edges of a surface) or three and four; keys of facets pack them so.
  return std::all_of(shape.facets.begin(), shape.facets.begin() + shape.facet_count,
                     [&](const FacetShape& facet) {
                       return shape.dimension == 2 ? facet.node_count == 2
                                                   : facet.node_count == 3 || facet.node_count == 4;
                     });
}
static_assert(std::all_of(kTable.begin(), kTable.end(), keeps_limits),
              "an element type exceeds a limit of element.hpp: raise it, and what relies on it");
static_assert(
    [] {
      for (const ElementType type : kLinearTypes) {
        const ElementShape& shape = kTable[static_cast<std::size_t>(type)];
        const bool four = shape.dimension == 3 && shape.node_count == 4;
        if (four != (type == ElementType::tetrahedron)) return false;
      }
      return true;
    }(),
    "steps take a volume element with four nodes for a tetrahedron");
static_assert(
    [] {
      for (std::size_t type = 0; type < kLinearTypeCount; ++type) {
        if (kTable[type].node_count != kNodesPerElement[type]) return false;
      }
      return true;
    }(),
    "kNodesPerElement differs from the element table");

constexpr std::array<std::string_view, kElementTypeCount> kNames = {
    "triangle",   "quad",      "tetrahedron", "pyramid",      "wedge",
    "hexahedron", "triangle6", "quad8",       "quad9",        "tetrahedron10",
    "pyramid13",  "wedge15",   "wedge18",     "hexahedron20", "hexahedron27"};
static_assert(
    [] {
      for (std::size_t type = 0; type < kLinearTypeCount; ++type) {
        if (kTable[type].name != kNames[type]) return false;
      }
      return true;
    }(),
    "the names differ from the element table");

struct MidNodes {
  std::size_t count = 0;
  std::array<MidNode, 19> nodes{};
};

/// VTK's order: along the edges of the table, then, where the type has them, on its faces with four
/// corners, then in the element.
constexpr MidNodes list_mid_nodes(ElementType type) {
  MidNodes result;
  if (!is_second_order(type)) return result;
  const ElementShape& shape = kTable[static_cast<std::size_t>(linear_type(type))];
  const std::size_t count = element_width(type) - static_cast<std::size_t>(shape.node_count);
  for (int e = 0; e < shape.edge_count; ++e) {
    result.nodes[result.count++] = {2, {shape.edges[e][0], shape.edges[e][1]}};
  }
  if (count == result.count) return result;
  for (int f = 0; shape.dimension == 3 && f < shape.facet_count; ++f) {
    const auto& c = shape.facets[f].nodes;
    if (shape.facets[f].node_count != 4) continue;
    result.nodes[result.count++] = {4, {c[0], c[1], c[2], c[3]}};
  }
  if (count == result.count) return result;
  MidNode centre{shape.node_count, {}};
  for (std::int8_t n = 0; n < shape.node_count; ++n) centre.corners[n] = n;
  result.nodes[result.count++] = centre;
  return result;
}

constexpr std::array<MidNodes, kElementTypeCount> kMidNodes = [] {
  std::array<MidNodes, kElementTypeCount> table{};
  for (const ElementType type : kElementTypes) {
    table[static_cast<std::size_t>(type)] = list_mid_nodes(type);
  }
  return table;
}();
static_assert(std::all_of(kElementTypes.begin(), kElementTypes.end(),
                          [](ElementType type) {
                            const auto row = static_cast<std::size_t>(type);
                            const ElementShape& shape =
                                kTable[static_cast<std::size_t>(linear_type(type))];
                            return kMidNodes[row].count +
                                       static_cast<std::size_t>(shape.node_count) ==
                                   element_width(type);
                          }),
              "kNodesPerElement differs from the nodes in the middle of edges and faces");

}  // namespace

std::string_view element_name(ElementType type) noexcept {
  return kNames[static_cast<std::size_t>(type)];
}

const ElementShape& element_shape(ElementType type) noexcept {
  return kTable[static_cast<std::size_t>(linear_type(type))];
}

const std::array<ElementShape, kLinearTypeCount>& element_table() noexcept { return kTable; }

std::span<const MidNode> mid_nodes(ElementType type) noexcept {
  const MidNodes& row = kMidNodes[static_cast<std::size_t>(type)];
  return std::span(row.nodes).first(row.count);
}

}  // namespace meshsmooth

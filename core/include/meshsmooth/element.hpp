#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace meshsmooth {

/// Index of a node. Node ids are 32-bit, everything that counts more is 64-bit.
using NodeId = std::int32_t;

/// The element types, in VTK's node order: the linear ones, then those of second order, whose
/// corners come first and the nodes in the middle of edges, faces and the element after them
/// (`mid_nodes`). In a wedge, seen from the triangle 3-4-5, the triangle 0-1-2 is clockwise: the
/// opposite of Gmsh, Exodus and Abaqus.
enum class ElementType : std::uint8_t {
  triangle,
  quad,
  tetrahedron,
  pyramid,
  wedge,
  hexahedron,
  triangle6,
  quad8,
  quad9,
  tetrahedron10,
  pyramid13,
  wedge15,
  wedge18,
  hexahedron20,
  hexahedron27,
};

inline constexpr std::size_t kLinearTypeCount = 6;
inline constexpr std::array<ElementType, kLinearTypeCount> kLinearTypes = {
    ElementType::triangle, ElementType::quad,  ElementType::tetrahedron,
    ElementType::pyramid,  ElementType::wedge, ElementType::hexahedron};

inline constexpr std::size_t kElementTypeCount = 15;
inline constexpr std::array<ElementType, kElementTypeCount> kElementTypes = {
    ElementType::triangle,      ElementType::quad,         ElementType::tetrahedron,
    ElementType::pyramid,       ElementType::wedge,        ElementType::hexahedron,
    ElementType::triangle6,     ElementType::quad8,        ElementType::quad9,
    ElementType::tetrahedron10, ElementType::pyramid13,    ElementType::wedge15,
    ElementType::wedge18,       ElementType::hexahedron20, ElementType::hexahedron27};

/// By type, as in the table (element.cpp asserts it), for code that needs them at compile time.
inline constexpr std::array<int, kElementTypeCount> kNodesPerElement = {3, 4,  4,  5,  6,  8,  6, 8,
                                                                        9, 10, 13, 15, 18, 20, 27};

/// @returns the number of nodes of an element, those in the middle of edges and faces included
[[nodiscard]] constexpr std::size_t element_width(ElementType type) {
  return static_cast<std::size_t>(kNodesPerElement[static_cast<std::size_t>(type)]);
}

/// @returns the type of the element that the corners form; of a linear type itself
[[nodiscard]] constexpr ElementType linear_type(ElementType type) {
  constexpr std::array<ElementType, kElementTypeCount> kLinear = {
      ElementType::triangle,    ElementType::quad,       ElementType::tetrahedron,
      ElementType::pyramid,     ElementType::wedge,      ElementType::hexahedron,
      ElementType::triangle,    ElementType::quad,       ElementType::quad,
      ElementType::tetrahedron, ElementType::pyramid,    ElementType::wedge,
      ElementType::wedge,       ElementType::hexahedron, ElementType::hexahedron};
  return kLinear[static_cast<std::size_t>(type)];
}
[[nodiscard]] constexpr bool is_second_order(ElementType type) { return linear_type(type) != type; }

/// @returns the name of a type: "tetrahedron", "tetrahedron10"
[[nodiscard]] std::string_view element_name(ElementType type) noexcept;

/// Limits of the table, which arrays of a fixed size and packed keys rely on (element.cpp
/// asserts them).
inline constexpr int kMaxElementNodes = 27;
inline constexpr int kMaxCorners = 8;
inline constexpr int kMaxFacetNodes = 4;
inline constexpr int kMaxElementFacets = 6;
inline constexpr int kMaxNodeEdges = 4;   // edges of an element at one of its nodes
inline constexpr int kMaxNodeFacets = 4;  // facets of an element at one of its nodes

/// A facet: the face of a volume element or the edge of a surface element, as local node
/// numbers. Seen from outside, the nodes of a face are counter-clockwise.
struct FacetShape {
  std::int8_t node_count;
  std::array<std::int8_t, kMaxFacetNodes> nodes;
};

/// The ideal corner of an element: the inverse of the matrix of the ideal edge vectors, by rows.
/// A corner matrix A (columns = edge vectors) has the shape matrix A * inverse.
struct IdealCorner {
  std::array<std::array<double, 3>, 3> inverse;
  double determinant;  // of the ideal edge vectors scaled to length 1
};

/// A corner: the node and its neighbours along edges, ordered so that the determinant of the edge
/// vectors is positive in a valid element. Surface elements have two neighbours per corner. The
/// four corners of a pyramid's base also cover its apex.
struct CornerShape {
  std::int8_t node;
  std::array<std::int8_t, 3> neighbours;
};

/// One row of the element table: all that the steps and the quality measures know of a linear type.
struct ElementShape {
  std::string_view name;  // "tetrahedron"
  std::int8_t dimension;  // 2 or 3
  std::int8_t node_count;
  std::int8_t edge_count;
  std::int8_t facet_count;
  std::int8_t corner_count;
  std::array<std::array<std::int8_t, 2>, 12> edges;
  std::array<FacetShape, kMaxElementFacets> facets;
  std::array<CornerShape, kMaxCorners> corners;
  IdealCorner ideal;  // the same at every corner
};

/// @returns the row of a type, of one of second order that of its corners; it lives as long as the
/// program. O(1), thread-safe.
[[nodiscard]] const ElementShape& element_shape(ElementType type) noexcept;

/// @returns the whole table, by linear type; for upload to a device.
[[nodiscard]] const std::array<ElementShape, kLinearTypeCount>& element_table() noexcept;

/// A node in the middle of an edge, of a face or of the element, by the corners of that part.
struct MidNode {
  std::int8_t corner_count;                      // 2, 4 or 8
  std::array<std::int8_t, kMaxCorners> corners;  // local node numbers
};

/// @returns the nodes of a type after its corners, in their order; none of a linear type. O(1).
[[nodiscard]] std::span<const MidNode> mid_nodes(ElementType type) noexcept;

}  // namespace meshsmooth

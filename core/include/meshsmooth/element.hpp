#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace meshsmooth {

/// Index of a node. Node ids are 32-bit, everything that counts more is 64-bit.
using NodeId = std::int32_t;

/// The linear element types, in VTK's node order. In a wedge, seen from the triangle 3-4-5, the
/// triangle 0-1-2 is clockwise: the opposite of Gmsh, Exodus and Abaqus.
enum class ElementType : std::uint8_t { triangle, quad, tetrahedron, pyramid, wedge, hexahedron };

inline constexpr std::size_t kElementTypeCount = 6;
inline constexpr std::array<ElementType, kElementTypeCount> kElementTypes = {
    ElementType::triangle, ElementType::quad,  ElementType::tetrahedron,
    ElementType::pyramid,  ElementType::wedge, ElementType::hexahedron};
/// By type, as in the table (element.cpp asserts it), for code that needs them at compile time.
inline constexpr std::array<int, kElementTypeCount> kNodesPerElement = {3, 4, 4, 5, 6, 8};

/// Limits of the table, which arrays of a fixed size and packed keys rely on (element.cpp
/// asserts them).
inline constexpr int kMaxElementNodes = 8;
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

/// One row of the element table: all that the steps and the quality measures know of a type.
struct ElementShape {
  std::string_view name;  // "tetrahedron"
  std::int8_t dimension;  // 2 or 3
  std::int8_t node_count;
  std::int8_t edge_count;
  std::int8_t facet_count;
  std::int8_t corner_count;
  std::array<std::array<std::int8_t, 2>, 12> edges;
  std::array<FacetShape, kMaxElementFacets> facets;
  std::array<CornerShape, kMaxElementNodes> corners;
  IdealCorner ideal;  // the same at every corner
};

/// @returns the row of a type; it lives as long as the program. O(1), thread-safe.
[[nodiscard]] const ElementShape& element_shape(ElementType type) noexcept;

/// @returns the whole table, by element type; for upload to a device.
[[nodiscard]] const std::array<ElementShape, kElementTypeCount>& element_table() noexcept;

}  // namespace meshsmooth

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "meshsmooth/element.hpp"
#include "meshsmooth/vec3.hpp"

namespace meshsmooth {

/// A run of elements of one type, not owned.
struct ElementBlockView {
  ElementType type;
  std::span<const NodeId> nodes;  // element_count() x nodes of the type

  [[nodiscard]] std::size_t element_count() const { return nodes.size() / element_width(type); }
};

/// A mesh without its positions, not owned. Element ids count through all blocks in order; all
/// blocks have the same dimension.
struct TopologyView {
  std::size_t node_count = 0;
  std::span<const ElementBlockView> blocks;
  std::span<const std::uint8_t> fixed;  // [node_count], non-zero = fixed; or empty
  /// [element_count()]: the facets between two regions keep their shape as the boundary does. Or
  /// empty: one region.
  std::span<const std::int32_t> regions = {};
  /// That of a `CanonicalTopology`: jobs need not look for what it changes.
  bool canonical = false;

  [[nodiscard]] std::size_t element_count() const;
};

/// Node positions in the caller's precision, [node_count], in the mesh's unit; not owned.
using PositionsView = std::variant<std::span<const Vec3f>, std::span<const Vec3d>>;
using PositionsSpan = std::variant<std::span<Vec3f>, std::span<Vec3d>>;

[[nodiscard]] PositionsView as_view(const PositionsSpan& positions);
[[nodiscard]] std::size_t position_count(const PositionsView& positions);

/// A run of elements of one type.
struct ElementBlock {
  ElementType type;
  std::vector<NodeId> nodes;
};

/// Owns node positions and connectivity on the host. A mesh need not be valid: see `validate`.
struct Mesh {
  std::variant<std::vector<Vec3f>, std::vector<Vec3d>> positions = std::vector<Vec3d>{};
  std::vector<ElementBlock> blocks;
  std::vector<std::uint8_t> fixed;         // one byte per node, non-zero = fixed; or empty
  std::vector<std::int32_t> regions = {};  // one per element; or empty: one region

  [[nodiscard]] std::size_t node_count() const;
  [[nodiscard]] std::size_t element_count() const;
  [[nodiscard]] PositionsView positions_view() const;
  [[nodiscard]] PositionsSpan positions_span();
  [[nodiscard]] std::vector<ElementBlockView> block_views() const;
};

/// A `TopologyView` of a mesh and the block views it points to. The mesh must outlive it.
class MeshTopology {
 public:
  explicit MeshTopology(const Mesh& mesh)
      : blocks_(mesh.block_views()),
        node_count_(mesh.node_count()),
        fixed_(mesh.fixed),
        regions_(mesh.regions) {}
  [[nodiscard]] TopologyView view() const { return {node_count_, blocks_, fixed_, regions_}; }

 private:
  std::vector<ElementBlockView> blocks_;
  std::size_t node_count_;
  std::span<const std::uint8_t> fixed_;
  std::span<const std::int32_t> regions_;
};

/// @returns the nodes of the facets that one element alone has, or three and more elements of a
/// surface mesh, ascending, and with `between_regions` of those between two regions. O(elements),
/// multi-threaded. The topology must be valid.
[[nodiscard]] std::vector<NodeId> find_boundary_nodes(const TopologyView& topology,
                                                      bool between_regions = false);

/// Checks that a mesh is valid: it has nodes and elements, blocks of one dimension with whole
/// elements, every index in range, no element with a repeated node, finite coordinates, and a
/// fixed mask and regions of the right size. Facets of a volume mesh used more than twice are found
/// by the boundary step instead. O(nodes + elements), multi-threaded.
///
/// @throws InvalidMesh naming the first offender (lowest id): MESH_EMPTY, ARRAY_SIZE_MISMATCH,
///         MIXED_DIMENSIONS, INDEX_OUT_OF_RANGE, REPEATED_NODE, NON_FINITE_COORDINATE
void validate(const TopologyView& topology, const PositionsView& positions);

/// The part of `validate` that needs no positions.
void validate(const TopologyView& topology);

/// Throws the InvalidMesh (REPEATED_NODE) of `validate`.
///
/// @param element  its id
[[noreturn]] void throw_repeated_node(std::size_t element, ElementType type,
                                      std::span<const NodeId> nodes);

/// The part of `validate` for new positions of a valid topology. O(nodes), multi-threaded.
void validate_positions(const TopologyView& topology, const PositionsView& positions);

/// The same for the positions of a reference; errors name it.
void validate_reference(const TopologyView& topology, const PositionsView& reference);

/// The part of `validate` that reads sizes and types only, not the arrays. O(blocks).
void validate_sizes(const TopologyView& topology);
void validate_sizes(const TopologyView& topology, const PositionsView& positions);

}  // namespace meshsmooth

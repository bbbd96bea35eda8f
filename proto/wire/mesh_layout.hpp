#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshsmooth/smoother.hpp"
#include "meshsmooth/v1/mesh.pb.h"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::wire {

/// Largest mesh that a receiver takes.
struct MeshLimits {
  std::int64_t max_node_count = INT32_MAX;
  std::int64_t max_element_count = INT32_MAX;
  std::int64_t max_mesh_bytes = INT64_MAX;  // all arrays together
};

/// What a spec announces, after every size has been checked: nothing in here
/// overflows. Makes no allocation that depends on the announced sizes.
struct MeshLayout {
  struct Block {
    ElementType type;
    std::int64_t element_count;
  };

  std::int64_t node_count = 0;
  std::vector<Block> blocks;
  bool float64 = true;
  bool regions_present = false;  // elements have regions, which come or are here already
  std::int64_t elements_bytes = 0;
  std::int64_t fixed_mask_bytes = 0;       // 0: no mask follows
  std::int64_t element_regions_bytes = 0;  // 0: no regions follow
  std::int64_t coordinates_bytes = 0;
  bool coordinates_follow = true;    // else there is only room for those of the result
  std::int64_t reference_bytes = 0;  // of this job alone; 0: none follows
  /// Of a reference that is kept with the topology; unset: it has none.
  std::optional<bool> kept_reference_float64 = {};
  std::int64_t kept_reference_bytes = 0;  // 0: none follows
  std::int64_t prescribed_count = 0;      // nodes
  bool cotangents = false;          // the coordinates are those of all nodes; none are prescribed
  std::int64_t pair_count = 0;      // of nodes
  std::int64_t surface_points = 0;  // of a target surface
  std::int64_t surface_triangles = 0;
  bool surface_patches = false;  // each triangle has a patch

  [[nodiscard]] std::int64_t topology_bytes() const {
    return elements_bytes + fixed_mask_bytes + element_regions_bytes + kept_reference_bytes;
  }
  [[nodiscard]] std::int64_t prescribed_nodes_bytes() const {
    return prescribed_count * static_cast<std::int64_t>(sizeof(NodeId));
  }
  [[nodiscard]] std::int64_t prescribed_coordinates_bytes() const {
    return cotangents ? 0 : prescribed_count * position_bytes(float64);
  }
  [[nodiscard]] std::int64_t node_pairs_bytes() const {
    return pair_count * static_cast<std::int64_t>(sizeof(NodePair));
  }
  [[nodiscard]] std::int64_t surface_points_bytes() const {
    return surface_points * static_cast<std::int64_t>(sizeof(Vec3d));
  }
  [[nodiscard]] std::int64_t surface_triangles_bytes() const {
    return surface_triangles * 3 * static_cast<std::int64_t>(sizeof(std::int32_t));
  }
  [[nodiscard]] std::int64_t surface_patches_bytes() const {
    return surface_patches ? surface_triangles * static_cast<std::int64_t>(sizeof(std::int32_t))
                           : 0;
  }
  /// Of the target surface.
  [[nodiscard]] std::int64_t surface_bytes() const {
    return surface_points_bytes() + surface_triangles_bytes() + surface_patches_bytes();
  }
  /// Of all arrays, that of the result included.
  [[nodiscard]] std::int64_t total_bytes() const {
    return topology_bytes() + coordinates_bytes + reference_bytes + prescribed_nodes_bytes() +
           prescribed_coordinates_bytes() + node_pairs_bytes() + surface_bytes();
  }
  [[nodiscard]] static std::int64_t position_bytes(bool as_float64) {
    return as_float64 ? sizeof(Vec3d) : sizeof(Vec3f);
  }
  /// The coordinates of a reference follow too. Throws OutOfMemory (MESH_TOO_LARGE).
  void expect_reference(const MeshLimits& limits);
  /// Prescribed nodes follow, and no coordinates: the kept reference moves. With `of_cotangents`
  /// cotangents of all nodes as coordinates. Throws InvalidOption (OPTION_OUT_OF_RANGE,
  /// SPEC_MISSING without a reference), NotSupported (OPTION_NOT_SUPPORTED: cotangents of another
  /// type than the reference), OutOfMemory (MESH_TOO_LARGE).
  void expect_prescribed(std::int64_t count, const MeshLimits& limits, bool of_cotangents);
  /// Node pairs follow, or none if `count` is 0. Throws InvalidOption (OPTION_OUT_OF_RANGE),
  /// OutOfMemory (MESH_TOO_LARGE).
  void expect_node_pairs(std::int64_t count, const MeshLimits& limits);
  /// A target surface follows. Throws InvalidOption (OPTION_OUT_OF_RANGE), OutOfMemory
  /// (MESH_TOO_LARGE).
  void expect_surface(const v1::SurfaceSpec& surface, const MeshLimits& limits);
  [[nodiscard]] std::int64_t element_count() const;
  struct Array {
    v1::ArrayId id;
    std::int64_t size_bytes;
  };
  /// Those that follow, in their order.
  [[nodiscard]] std::vector<Array> arrays() const;
  /// Of a mesh whose topology is there already: only coordinates come, of this type.
  [[nodiscard]] MeshLayout coordinates_only(bool as_float64) const;
  [[nodiscard]] MeshSize size() const;
};

/// Throws InvalidMesh (MESH_EMPTY, MIXED_DIMENSIONS), InvalidOption
/// (OPTION_OUT_OF_RANGE), NotSupported (OPTION_NOT_SUPPORTED) or OutOfMemory
/// (MESH_TOO_LARGE with "need_…" and "limit_…"). O(blocks).
[[nodiscard]] MeshLayout decode_layout(const v1::TopologySpec& topology,
                                       v1::ScalarType coordinate_type, const MeshLimits& limits);

/// Throws NotSupported (OPTION_NOT_SUPPORTED).
[[nodiscard]] bool decode_float64(v1::ScalarType type,
                                  const std::string& field = "coordinate_type");

/// What a sender announces of its mesh.
[[nodiscard]] v1::TopologySpec encode_topology_spec(const TopologyView& topology);
/// The type of positions on the wire.
[[nodiscard]] v1::ScalarType encode_position_type(const PositionsView& positions);

}  // namespace meshsmooth::wire

#include "wire/mesh_layout.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

#include "meshsmooth/error.hpp"
#include "wire/codec.hpp"

namespace meshsmooth::wire {
namespace {

constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();

// What does not fit 64 bits is larger than any limit, so saturating is enough.
std::int64_t saturating_add(std::int64_t a, std::int64_t b) {
  std::int64_t sum;
  return __builtin_add_overflow(a, b, &sum) ? kMax : sum;
}

std::int64_t saturating_multiply(std::int64_t a, std::int64_t b) {
  std::int64_t product;
  return __builtin_mul_overflow(a, b, &product) ? kMax : product;
}

void need_at_most(std::int64_t need, std::int64_t limit, const std::string& unit) {
  if (need <= limit) return;
  throw OutOfMemory(
      "MESH_TOO_LARGE",
      "the mesh needs " + std::to_string(need) + " " + unit + ", this server takes at most " +
          std::to_string(limit),
      {{"need_" + unit, std::to_string(need)}, {"limit_" + unit, std::to_string(limit)}});
}

void need_not_negative(std::int64_t count, const std::string& field) {
  if (count >= 0) return;
  throw InvalidOption("OPTION_OUT_OF_RANGE",
                      field + " is " + std::to_string(count) + ", it must be 0 or more",
                      {{"field", field}});
}

}  // namespace

std::int64_t MeshLayout::element_count() const {
  return std::accumulate(
      blocks.begin(), blocks.end(), std::int64_t{0},
      [](std::int64_t sum, const Block& block) { return sum + block.element_count; });
}

void MeshLayout::expect_reference(const MeshLimits& limits) {
  reference_bytes = coordinates_bytes;
  need_at_most(saturating_add(total_bytes() - reference_bytes, reference_bytes),
               limits.max_mesh_bytes, "bytes");
}

void MeshLayout::expect_prescribed(std::int64_t count, const MeshLimits& limits,
                                   bool of_cotangents) {
  if (!kept_reference_float64) {
    throw InvalidOption(
        "SPEC_MISSING",
        "inline_topology.reference_type: move moves the reference that is kept with "
        "the topology, and this one has none; send it inline with its reference",
        {{"field", "inline_topology.reference_type"}});
  }
  if (count < 1 || count > node_count) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "prescribed_node_count is " + std::to_string(count) +
                            ", it must be at least 1 and at most the number of nodes, " +
                            std::to_string(node_count),
                        {{"field", "prescribed_node_count"}});
  }
  // The result is written where they lie, and so would be a reference that is converted.
  if (of_cotangents && float64 != *kept_reference_float64) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "coordinate_type: cotangents come in the type of the reference",
                       {{"field", "coordinate_type"}});
  }
  coordinates_follow = of_cotangents;
  const std::int64_t others = total_bytes();
  cotangents = of_cotangents;
  prescribed_count = count;
  need_at_most(saturating_add(others, prescribed_nodes_bytes() + prescribed_coordinates_bytes()),
               limits.max_mesh_bytes, "bytes");
}

void MeshLayout::expect_node_pairs(std::int64_t count, const MeshLimits& limits) {
  // A node is in few pairs: at a corner of a box that is periodic in all directions, in seven.
  constexpr std::int64_t kMostPairsPerNode = 8;
  const std::int64_t most = saturating_multiply(kMostPairsPerNode, node_count);
  if (count < 0 || count > most) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "node_pair_count is " + std::to_string(count) +
                            ", it must be at least 0 and at most " + std::to_string(most) +
                            ", eight times the number of nodes",
                        {{"field", "node_pair_count"}});
  }
  const std::int64_t others = total_bytes();
  pair_count = count;
  need_at_most(saturating_add(others, node_pairs_bytes()), limits.max_mesh_bytes, "bytes");
}

void MeshLayout::expect_surface(const v1::SurfaceSpec& surface, const MeshLimits& limits) {
  const auto need_some = [](std::int64_t count, const std::string& field) {
    if (count >= 1) return;
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        field + " is " + std::to_string(count) + ", it must be 1 or more",
                        {{"field", field}});
  };
  need_some(surface.point_count(), "surface.point_count");
  need_some(surface.triangle_count(), "surface.triangle_count");
  need_at_most(surface.point_count(), limits.max_node_count, "nodes");
  need_at_most(surface.triangle_count(), limits.max_element_count, "elements");
  const std::int64_t others = total_bytes();
  surface_points = surface.point_count();
  surface_triangles = surface.triangle_count();
  surface_patches = surface.patches_present();
  need_at_most(saturating_add(others, surface_bytes()), limits.max_mesh_bytes, "bytes");
}

MeshLayout MeshLayout::coordinates_only(bool as_float64) const {
  MeshLayout layout = *this;
  layout.float64 = as_float64;
  layout.elements_bytes = layout.fixed_mask_bytes = layout.element_regions_bytes = 0;
  layout.reference_bytes = layout.kept_reference_bytes = layout.prescribed_count =
      layout.pair_count = layout.surface_points = layout.surface_triangles = 0;
  layout.coordinates_follow = true;
  layout.coordinates_bytes = node_count * position_bytes(as_float64);
  return layout;
}

std::vector<MeshLayout::Array> MeshLayout::arrays() const {
  std::vector<Array> arrays = {
      {v1::ARRAY_ID_ELEMENTS, elements_bytes},
      {v1::ARRAY_ID_FIXED_MASK, fixed_mask_bytes},
      {v1::ARRAY_ID_ELEMENT_REGIONS, element_regions_bytes},
      {v1::ARRAY_ID_REFERENCE_COORDINATES, kept_reference_bytes},
      {v1::ARRAY_ID_COORDINATES, coordinates_follow ? coordinates_bytes : 0},
      {v1::ARRAY_ID_REFERENCE_COORDINATES, reference_bytes},
      {v1::ARRAY_ID_PRESCRIBED_NODES, prescribed_nodes_bytes()},
      {v1::ARRAY_ID_PRESCRIBED_COORDINATES, prescribed_coordinates_bytes()},
      {v1::ARRAY_ID_NODE_PAIRS, node_pairs_bytes()},
      {v1::ARRAY_ID_SURFACE_POINTS, surface_points_bytes()},
      {v1::ARRAY_ID_SURFACE_TRIANGLES, surface_triangles_bytes()},
      {v1::ARRAY_ID_SURFACE_PATCHES, surface_patches_bytes()}};
  std::erase_if(arrays, [](const Array& array) { return array.size_bytes == 0; });
  return arrays;
}

MeshSize MeshLayout::size() const {
  MeshSize size{.node_count = node_count,
                .element_counts = {},
                .float64 = float64,
                .regions = regions_present,
                .reference = kept_reference_float64.has_value(),
                .node_pairs = pair_count > 0,
                .surface_points = surface_points,
                .surface_triangles = surface_triangles};
  for (const Block& block : blocks) {
    size.element_counts[static_cast<std::size_t>(block.type)] += block.element_count;
  }
  return size;
}

bool decode_float64(v1::ScalarType type, const std::string& field) {
  if (type == v1::SCALAR_TYPE_FLOAT64) return true;
  if (type == v1::SCALAR_TYPE_FLOAT32) return false;
  throw NotSupported("OPTION_NOT_SUPPORTED", field + " must be FLOAT32 or FLOAT64",
                     {{"field", field}});
}

namespace {

// A block takes more memory here than in the message, and most of a mesh's elements are in few.
void check_block_count(const v1::TopologySpec& topology) {
  constexpr std::ptrdiff_t kMostEmpty = 64;
  constexpr int kMostBlocks = 4096;  // 64 KiB, as long as the job is listed
  const auto empty = std::ranges::count_if(
      topology.element_blocks(), [](const auto& block) { return block.element_count() == 0; });
  if (topology.element_blocks_size() > kMostBlocks) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "inline_topology.element_blocks: a mesh has at most " +
                            std::to_string(kMostBlocks) + " blocks, this one has " +
                            std::to_string(topology.element_blocks_size()) +
                            "; put the elements of one type into one block",
                        {{"field", "inline_topology.element_blocks"}});
  }
  if (empty <= kMostEmpty) return;
  throw InvalidMesh("MESH_EMPTY",
                    std::to_string(empty) + " element blocks have no elements; leave them out",
                    {{"field", "inline_topology.element_blocks"}});
}

}  // namespace

MeshLayout decode_layout(const v1::TopologySpec& topology, v1::ScalarType coordinate_type,
                         const MeshLimits& limits) {
  MeshLayout layout;
  layout.float64 = decode_float64(coordinate_type);
  layout.node_count = topology.node_count();
  need_not_negative(layout.node_count, "inline_topology.node_count");

  check_block_count(topology);
  std::int64_t element_count = 0;
  std::optional<ElementType> first;
  for (const v1::ElementBlock& block : topology.element_blocks()) {
    const ElementType type =
        decode_element_type(block.element_type(), "inline_topology.element_blocks.element_type");
    need_not_negative(block.element_count(), "inline_topology.element_blocks.element_count");
    const auto refuse_mix = [&](const char* reason, const char* what) {
      const std::string number = std::to_string(layout.blocks.size());
      throw InvalidMesh(
          reason,
          "element block " + number + " (" + std::string(element_name(type)) + ") mixes " + what,
          {{"block", number}});
    };
    if (!first) first = type;
    if (element_shape(*first).dimension != element_shape(type).dimension) {
      refuse_mix("MIXED_DIMENSIONS", "surface and volume elements; send them as separate meshes");
    }
    if (is_second_order(*first) != is_second_order(type)) {
      refuse_mix("MIXED_ORDERS", "linear and second-order elements");
    }
    element_count = saturating_add(element_count, block.element_count());
    layout.elements_bytes = saturating_add(
        layout.elements_bytes,
        saturating_multiply(block.element_count(),
                            static_cast<std::int64_t>(element_width(type) * sizeof(NodeId))));
    layout.blocks.push_back({type, block.element_count()});
  }
  if (layout.node_count == 0) throw InvalidMesh("MESH_EMPTY", "the mesh has no nodes");
  if (element_count == 0) throw InvalidMesh("MESH_EMPTY", "the mesh has no elements");
  need_at_most(layout.node_count, limits.max_node_count, "nodes");
  need_at_most(element_count, limits.max_element_count, "elements");

  layout.fixed_mask_bytes = topology.fixed_mask_present() ? layout.node_count : 0;
  layout.regions_present = topology.element_regions_present();
  if (layout.regions_present) {
    layout.element_regions_bytes = saturating_multiply(element_count, sizeof(std::int32_t));
  }
  layout.coordinates_bytes =
      saturating_multiply(layout.node_count, layout.float64 ? sizeof(Vec3d) : sizeof(Vec3f));
  std::int64_t total_bytes = saturating_add(layout.elements_bytes, layout.fixed_mask_bytes);
  total_bytes = saturating_add(total_bytes, layout.element_regions_bytes);
  total_bytes = saturating_add(total_bytes, layout.coordinates_bytes);
  if (topology.reference_type() != v1::SCALAR_TYPE_UNSPECIFIED) {
    const bool as_float64 =
        decode_float64(topology.reference_type(), "inline_topology.reference_type");
    layout.kept_reference_float64 = as_float64;
    layout.kept_reference_bytes =
        saturating_multiply(layout.node_count, MeshLayout::position_bytes(as_float64));
    total_bytes = saturating_add(total_bytes, layout.kept_reference_bytes);
  }
  need_at_most(total_bytes, limits.max_mesh_bytes, "bytes");
  return layout;
}

v1::ScalarType encode_position_type(const PositionsView& positions) {
  return std::holds_alternative<std::span<const Vec3d>>(positions) ? v1::SCALAR_TYPE_FLOAT64
                                                                   : v1::SCALAR_TYPE_FLOAT32;
}

v1::TopologySpec encode_topology_spec(const TopologyView& topology) {
  v1::TopologySpec spec;
  spec.set_node_count(static_cast<std::int64_t>(topology.node_count));
  for (const ElementBlockView& block : topology.blocks) {
    v1::ElementBlock* message = spec.add_element_blocks();
    message->set_element_type(encode_element_type(block.type));
    message->set_element_count(static_cast<std::int64_t>(block.element_count()));
  }
  spec.set_fixed_mask_present(!topology.fixed.empty());
  spec.set_element_regions_present(!topology.regions.empty());
  return spec;
}

}  // namespace meshsmooth::wire

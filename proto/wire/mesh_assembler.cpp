#include "wire/mesh_assembler.hpp"

#include <bit>
#include <ranges>
#include <string>
#include <utility>

#include "meshsmooth/error.hpp"

namespace meshsmooth::wire {
namespace {

// Bytes of the wire become numbers without a conversion.
static_assert(std::endian::native == std::endian::little);
static_assert(sizeof(Vec3f) == 12 && sizeof(Vec3d) == 24 && sizeof(NodeId) == 4);

constexpr std::size_t kTopologyArrays = 4;  // they come first

std::size_t size_of(std::int64_t bytes) { return static_cast<std::size_t>(bytes); }

std::string array_name(v1::ArrayId id) {
  const std::string& name = v1::ArrayId_Name(id);
  return name.empty() ? std::to_string(static_cast<int>(id)) : name;
}

ErrorDetails where(const ChunkView& chunk) {
  return {{"array", array_name(chunk.array_id)},
          {"offset_bytes", std::to_string(chunk.offset_bytes)}};
}

std::string describe(const ChunkView& chunk) {
  return "chunk of " + array_name(chunk.array_id) + " at byte " +
         std::to_string(chunk.offset_bytes);
}

}  // namespace

PositionsView positions_in(std::span<const std::byte> bytes, bool float64) {
  const std::byte* const data = bytes.data();
  if (float64) {
    return std::span(reinterpret_cast<const Vec3d*>(data), bytes.size() / sizeof(Vec3d));
  }
  return std::span(reinterpret_cast<const Vec3f*>(data), bytes.size() / sizeof(Vec3f));
}

TopologyArrays::TopologyArrays(const MeshLayout& layout, std::pmr::memory_resource* memory)
    : node_count_(size_of(layout.node_count)),
      elements_(size_of(layout.elements_bytes), memory),
      fixed_mask_(size_of(layout.fixed_mask_bytes), memory),
      element_regions_(size_of(layout.element_regions_bytes), memory),
      reference_(size_of(layout.kept_reference_bytes), memory),
      reference_float64_(layout.kept_reference_float64.value_or(true)) {
  const auto* nodes = reinterpret_cast<const NodeId*>(elements_.data());
  blocks_.reserve(layout.blocks.size());
  for (const MeshLayout::Block& block : layout.blocks) {
    const std::size_t node_count = size_of(block.element_count) * element_width(block.type);
    blocks_.push_back({block.type, {nodes, node_count}});
    nodes += node_count;
  }
}

TopologyView TopologyArrays::view() const {
  return {.node_count = node_count_,
          .blocks = blocks_,
          .fixed = {reinterpret_cast<const std::uint8_t*>(fixed_mask_.data()), fixed_mask_.size()},
          .regions = {reinterpret_cast<const std::int32_t*>(element_regions_.data()),
                      element_regions_.size() / sizeof(std::int32_t)}};
}

std::int64_t TopologyArrays::size_bytes() const {
  return static_cast<std::int64_t>(elements_.size() + fixed_mask_.size() + element_regions_.size() +
                                   reference_.size());
}

PositionsView TopologyArrays::reference() const {
  return positions_in(reference_.bytes(), reference_float64_);
}

MeshAssembler::MeshAssembler(MeshLayout layout, std::shared_ptr<const TopologyArrays> topology,
                             std::pmr::memory_resource* memory,
                             std::optional<ByteArray> coordinates)
    : layout_(std::move(layout)),
      topology_(std::move(topology)),
      coordinates_(coordinates ? std::move(*coordinates)
                               : ByteArray(size_of(layout_.coordinates_bytes), memory)),
      reference_(size_of(layout_.reference_bytes), memory),
      prescribed_nodes_(size_of(layout_.prescribed_nodes_bytes()), memory),
      prescribed_coordinates_(size_of(layout_.prescribed_coordinates_bytes()), memory),
      node_pairs_(size_of(layout_.node_pairs_bytes()), memory),
      surface_points_(size_of(layout_.surface_points_bytes()), memory),
      surface_triangles_(size_of(layout_.surface_triangles_bytes()), memory),
      surface_patches_(size_of(layout_.surface_patches_bytes()), memory) {
  std::shared_ptr<TopologyArrays> own;
  if (!topology_) topology_ = own = std::make_shared<TopologyArrays>(layout_, memory);
  arrays_ = list_arrays(own.get());
  skip_complete_arrays();
}

/// Without a topology its arrays are there already.
std::array<MeshAssembler::Array, 12> MeshAssembler::list_arrays(TopologyArrays* topology) {
  const auto array = [](v1::ArrayId id, ByteArray& bytes) {
    return Array{id, bytes.data(), bytes.size()};
  };
  const auto own = [&](v1::ArrayId id, ByteArray TopologyArrays::*bytes) {
    return topology == nullptr ? Array{id, nullptr, 0} : array(id, topology->*bytes);
  };
  return {own(v1::ARRAY_ID_ELEMENTS, &TopologyArrays::elements_),
          own(v1::ARRAY_ID_FIXED_MASK, &TopologyArrays::fixed_mask_),
          own(v1::ARRAY_ID_ELEMENT_REGIONS, &TopologyArrays::element_regions_),
          own(v1::ARRAY_ID_REFERENCE_COORDINATES, &TopologyArrays::reference_),
          layout_.coordinates_follow ? array(v1::ARRAY_ID_COORDINATES, coordinates_)
                                     : Array{v1::ARRAY_ID_COORDINATES, nullptr, 0},
          array(v1::ARRAY_ID_REFERENCE_COORDINATES, reference_),
          array(v1::ARRAY_ID_PRESCRIBED_NODES, prescribed_nodes_),
          array(v1::ARRAY_ID_PRESCRIBED_COORDINATES, prescribed_coordinates_),
          array(v1::ARRAY_ID_NODE_PAIRS, node_pairs_),
          array(v1::ARRAY_ID_SURFACE_POINTS, surface_points_),
          array(v1::ARRAY_ID_SURFACE_TRIANGLES, surface_triangles_),
          array(v1::ARRAY_ID_SURFACE_PATCHES, surface_patches_)};
}

void MeshAssembler::skip_complete_arrays() {
  while (current_ < arrays_.size() &&
         arrays_[current_].received_bytes == arrays_[current_].size_bytes) {
    ++current_;
  }
}

void MeshAssembler::throw_unexpected(const ChunkView& chunk) const {
  for (std::size_t i = 0; i < current_; ++i) {
    const Array& array = arrays_[i];
    if (array.id == chunk.array_id && array.size_bytes > 0 &&
        chunk.offset_bytes == static_cast<std::int64_t>(array.size_bytes)) {
      throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                        describe(chunk) + ": the spec announced only " +
                            std::to_string(array.size_bytes) + " bytes of it",
                        where(chunk));
    }
  }
  const std::string expected = complete() ? "no more data"
                                          : array_name(arrays_[current_].id) + " at byte " +
                                                std::to_string(arrays_[current_].received_bytes);
  throw InvalidMesh("CHUNK_OUT_OF_ORDER", describe(chunk) + ", expected " + expected, where(chunk));
}

void MeshAssembler::add(const ChunkView& chunk) {
  if (complete()) throw_unexpected(chunk);
  Array& array = arrays_[current_];
  if (chunk.array_id != array.id ||
      chunk.offset_bytes != static_cast<std::int64_t>(array.received_bytes)) {
    throw_unexpected(chunk);
  }
  if (chunk.size_bytes > array.size_bytes - array.received_bytes) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                      describe(chunk) + " has " + std::to_string(chunk.size_bytes) +
                          " bytes, only " +
                          std::to_string(array.size_bytes - array.received_bytes) +
                          " are left of what the spec announced",
                      where(chunk));
  }
  if (!chunk.has_right_checksum()) {
    throw InvalidMesh("CHECKSUM_MISMATCH",
                      describe(chunk) + ": checksum mismatch: its bytes were corrupted in transit",
                      where(chunk));
  }
  chunk.copy_to(array.data + array.received_bytes);
  if (namer_ && current_ < kTopologyArrays) {
    namer_->add({array.data + array.received_bytes, chunk.size_bytes});
  }
  array.received_bytes += chunk.size_bytes;
  received_bytes_ += static_cast<std::int64_t>(chunk.size_bytes);
  skip_complete_arrays();
}

void MeshAssembler::finish() const {
  if (complete()) return;
  const Array& array = arrays_[current_];
  throw InvalidMesh(
      "ARRAY_SIZE_MISMATCH",
      array_name(array.id) + " ended after " + std::to_string(array.received_bytes) + " of " +
          std::to_string(array.size_bytes) + " bytes",
      {{"array", array_name(array.id)}, {"offset_bytes", std::to_string(array.received_bytes)}});
}

PositionsView MeshAssembler::reference() const {
  return reference_.size() > 0 ? positions_in(reference_.bytes(), layout_.float64)
                               : topology_->reference();
}

PrescribedNodes MeshAssembler::prescribed() const {
  return {{reinterpret_cast<const NodeId*>(prescribed_nodes_.data()),
           static_cast<std::size_t>(layout_.prescribed_count)},
          positions_in(prescribed_coordinates_.bytes(), layout_.float64)};
}

std::span<const NodePair> MeshAssembler::node_pairs() const {
  return {reinterpret_cast<const NodePair*>(node_pairs_.data()),
          static_cast<std::size_t>(layout_.pair_count)};
}

std::optional<SurfaceMesh> MeshAssembler::surface() const {
  if (layout_.surface_triangles == 0) return std::nullopt;
  const auto copy = [](const ByteArray& bytes, auto& to) {
    using T = std::ranges::range_value_t<decltype(to)>;
    const auto* const first = reinterpret_cast<const T*>(bytes.data());
    to.assign(first, first + bytes.size() / sizeof(T));
  };
  SurfaceMesh surface;
  copy(surface_points_, surface.points);
  copy(surface_triangles_, surface.triangles);
  copy(surface_patches_, surface.patches);
  return surface;
}

PositionsSpan MeshAssembler::positions() {
  const auto node_count = static_cast<std::size_t>(layout_.node_count);
  std::byte* data = coordinates_.data();
  if (layout_.float64) return std::span(reinterpret_cast<Vec3d*>(data), node_count);
  return std::span(reinterpret_cast<Vec3f*>(data), node_count);
}

}  // namespace meshsmooth::wire

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/v1/mesh.pb.h"
#include "wire/byte_array.hpp"
#include "wire/mesh_layout.hpp"
#include "wire/raw_message.hpp"
#include "wire/topology_name.hpp"

namespace meshsmooth::wire {

/// The arrays of a topology. Several meshes may share them.
class TopologyArrays {
 public:
  /// Allocates them from `memory`. Throws std::bad_alloc.
  TopologyArrays(const MeshLayout& layout, std::pmr::memory_resource* memory);

  [[nodiscard]] TopologyView view() const;
  /// Empty unless a reference is kept with it.
  [[nodiscard]] PositionsView reference() const;
  [[nodiscard]] std::int64_t size_bytes() const;

 private:
  friend class MeshAssembler;
  std::size_t node_count_;
  ByteArray elements_, fixed_mask_, element_regions_, reference_;
  bool reference_float64_;
  std::vector<ElementBlockView> blocks_;
};

/// Coordinates as they lie in memory.
[[nodiscard]] PositionsView positions_in(std::span<const std::byte> bytes, bool float64);

/// Turns the chunks of one mesh into arrays at their final place: one copy, no
/// zero fill. Not thread-safe.
///
///     MeshAssembler assembler(decode_layout(spec, type, limits));
///     for (chunk : stream) assembler.add(chunk);
///     assembler.finish();
///     smoother.smooth(assembler.topology(), assembler.positions(), …);
///
/// What the arrays say (indices, coordinates) is for core's `validate`.
class MeshAssembler {
 public:
  /// Allocates all arrays, each aligned to 64 bytes, from `memory`, which must
  /// outlive the assembler. Throws std::bad_alloc.
  explicit MeshAssembler(MeshLayout layout,
                         std::pmr::memory_resource* memory = std::pmr::new_delete_resource())
      : MeshAssembler(std::move(layout), nullptr, memory) {}
  /// @param topology  of a mesh whose topology is there: the layout announces no bytes of it; null:
  ///   it comes too.
  /// @param coordinates  their place, where it is there already.
  MeshAssembler(MeshLayout layout, std::shared_ptr<const TopologyArrays> topology,
                std::pmr::memory_resource* memory,
                std::optional<ByteArray> coordinates = std::nullopt);
  MeshAssembler(const MeshAssembler&) = delete;
  MeshAssembler& operator=(const MeshAssembler&) = delete;

  /// Has the topology's name made of what comes; before the first chunk.
  void name_topology() { namer_.emplace(layout_); }
  /// Needs a complete mesh. Once.
  [[nodiscard]] std::string topology_name() { return namer_.value().finish(); }

  /// Throws InvalidMesh: CHUNK_OUT_OF_ORDER (wrong array, gap, overlap),
  /// ARRAY_SIZE_MISMATCH (more bytes than announced), CHECKSUM_MISMATCH; with
  /// the details "array" and "offset_bytes". After a throw only destruction
  /// makes sense.
  void add(const ChunkView& chunk);
  void add(const v1::Chunk& chunk) { add(ChunkView(chunk)); }

  /// Throws InvalidMesh (ARRAY_SIZE_MISMATCH) unless complete.
  void finish() const;
  [[nodiscard]] bool complete() const { return current_ == arrays_.size(); }
  [[nodiscard]] std::int64_t received_bytes() const { return received_bytes_; }

  [[nodiscard]] const MeshLayout& layout() const { return layout_; }
  /// Views of the arrays; need a complete mesh and live as long as this.
  [[nodiscard]] TopologyView topology() const { return topology_->view(); }
  [[nodiscard]] PositionsSpan positions();
  /// That of the job, or else the one that is kept with the topology; may be empty.
  [[nodiscard]] PositionsView reference() const;
  /// Empty unless the layout announces prescribed nodes.
  [[nodiscard]] PrescribedNodes prescribed() const;
  /// Empty unless the layout announces node pairs.
  [[nodiscard]] std::span<const NodePair> node_pairs() const;
  /// A copy of the target surface; unset unless the layout announces one.
  [[nodiscard]] std::optional<SurfaceMesh> surface() const;
  [[nodiscard]] std::span<const std::byte> coordinate_bytes() const { return coordinates_.bytes(); }

  /// The topology, to be shared.
  [[nodiscard]] std::shared_ptr<const TopologyArrays> topology_arrays() const { return topology_; }
  /// The positions, apart from the rest, which may then go.
  [[nodiscard]] ByteArray take_coordinates() { return std::move(coordinates_); }

 private:
  struct Array {
    v1::ArrayId id = v1::ARRAY_ID_UNSPECIFIED;
    std::byte* data = nullptr;
    std::size_t size_bytes = 0;
    std::size_t received_bytes = 0;
  };

  [[nodiscard]] std::array<Array, 12> list_arrays(TopologyArrays* topology);
  void skip_complete_arrays();
  [[noreturn]] void throw_unexpected(const ChunkView& chunk) const;

  MeshLayout layout_;
  std::shared_ptr<const TopologyArrays> topology_;
  ByteArray coordinates_;
  ByteArray reference_;
  ByteArray prescribed_nodes_, prescribed_coordinates_, node_pairs_;
  ByteArray surface_points_, surface_triangles_, surface_patches_;
  std::array<Array, 12> arrays_;  // in the order of the stream; absent ones have no bytes
  std::size_t current_ = 0;
  std::int64_t received_bytes_ = 0;
  std::optional<TopologyNamer> namer_;
};

}  // namespace meshsmooth::wire

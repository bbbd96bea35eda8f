#include "wire/mesh_assembler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory_resource>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"
#include "wire/crc32c.hpp"

namespace meshsmooth::wire {
namespace {

using ::testing::ElementsAre;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// Two tetrahedra on five nodes, one of them fixed.
const std::string kElements = bytes_of<std::int32_t>({0, 1, 2, 3, 1, 2, 3, 4});
const std::string kFixed = {0, 1, 0, 0, 0};
const std::string kCoordinates = bytes_of<double>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});

MeshLayout layout() {
  MeshLayout layout;
  layout.node_count = 5;
  layout.blocks = {{ElementType::tetrahedron, 2}};
  layout.elements_bytes = 32;
  layout.fixed_mask_bytes = 5;
  layout.coordinates_bytes = 120;
  return layout;
}

v1::Chunk chunk(v1::ArrayId id, std::int64_t offset, const std::string& data) {
  v1::Chunk message;
  message.set_array_id(id);
  message.set_offset_bytes(offset);
  message.set_data(data);
  return message;
}

std::string reason_of(const std::function<void()>& function) {
  try {
    function();
  } catch (const InvalidMesh& error) {
    return error.reason();
  }
  return "nothing thrown";
}

class MeshAssemblerTest : public ::testing::Test {
 protected:
  std::string add(v1::ArrayId id, std::int64_t offset, const std::string& data) {
    return reason_of([&] { assembler_.add(chunk(id, offset, data)); });
  }
  MeshAssembler assembler_{layout()};
};

TEST_F(MeshAssemblerTest, PutsTheArraysInPlace) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler_.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  EXPECT_FALSE(assembler_.complete());
  assembler_.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));

  EXPECT_TRUE(assembler_.complete());
  EXPECT_NO_THROW(assembler_.finish());
  EXPECT_EQ(assembler_.received_bytes(), 157);
  const TopologyView topology = assembler_.topology();
  EXPECT_EQ(topology.node_count, 5U);
  ASSERT_EQ(topology.blocks.size(), 1U);
  EXPECT_THAT(topology.blocks[0].nodes, ElementsAre(0, 1, 2, 3, 1, 2, 3, 4));
  EXPECT_THAT(topology.fixed, ElementsAre(0, 1, 0, 0, 0));
  const auto positions = std::get<std::span<Vec3d>>(assembler_.positions());
  EXPECT_EQ(positions[4], (Vec3d{1, 1, 1}));
  EXPECT_EQ(assembler_.coordinate_bytes().size(), 120U);
}

TEST_F(MeshAssemblerTest, TakesTheTagsBetweenMaskAndCoordinates) {
  MeshLayout with_regions = layout();
  with_regions.element_regions_bytes = 8;
  MeshAssembler assembler(with_regions);
  assembler.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  const v1::Chunk coordinates = chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates);
  EXPECT_EQ(reason_of([&] { assembler.add(coordinates); }), "CHUNK_OUT_OF_ORDER");
  assembler.add(chunk(v1::ARRAY_ID_ELEMENT_REGIONS, 0, bytes_of<std::int32_t>({7, -7})));
  EXPECT_FALSE(assembler.complete());
  assembler.add(coordinates);

  EXPECT_TRUE(assembler.complete());
  EXPECT_EQ(assembler.received_bytes(), 165);
  EXPECT_THAT(assembler.topology().fixed, ElementsAre(0, 1, 0, 0, 0));
  EXPECT_THAT(assembler.topology().regions, ElementsAre(7, -7));
  EXPECT_EQ(std::get<std::span<Vec3d>>(assembler.positions())[4], (Vec3d{1, 1, 1}));
}

TEST_F(MeshAssemblerTest, TakesTheReferenceAfterTheCoordinates) {
  MeshLayout with_reference = layout();
  with_reference.expect_reference({});
  EXPECT_EQ(with_reference.total_bytes(), layout().total_bytes() + 120);
  MeshAssembler assembler(with_reference);
  assembler.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  assembler.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));
  EXPECT_EQ(reason_of([&] { assembler.finish(); }), "ARRAY_SIZE_MISMATCH");
  assembler.add(chunk(v1::ARRAY_ID_REFERENCE_COORDINATES, 0, bytes_of<double>({9, 8, 7})));
  assembler.add(chunk(v1::ARRAY_ID_REFERENCE_COORDINATES, 24, std::string(96, '\0')));

  assembler.finish();
  EXPECT_EQ(std::get<std::span<const Vec3d>>(assembler.reference())[0], (Vec3d{9, 8, 7}));
  EXPECT_EQ(position_count(assembler.reference()), 5);
  EXPECT_EQ(std::get<std::span<Vec3d>>(assembler.positions())[4], (Vec3d{1, 1, 1}));
  EXPECT_EQ(reason_of([&] { with_reference.expect_reference({.max_mesh_bytes = 277}); }),
            "nothing thrown");
  EXPECT_THROW(with_reference.expect_reference({.max_mesh_bytes = 276}), OutOfMemory);
}

TEST_F(MeshAssemblerTest, TakesNodePairsLast) {
  MeshLayout with_pairs = layout();
  with_pairs.expect_node_pairs(2, {});
  EXPECT_EQ(with_pairs.total_bytes(), layout().total_bytes() + 16);
  EXPECT_TRUE(with_pairs.size().node_pairs);
  MeshAssembler assembler(with_pairs);
  assembler.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  assembler.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));
  EXPECT_EQ(reason_of([&] { assembler.finish(); }), "ARRAY_SIZE_MISMATCH");
  assembler.add(chunk(v1::ARRAY_ID_NODE_PAIRS, 0, bytes_of<std::int32_t>({0, 4, 1, 3})));
  assembler.finish();
  EXPECT_THAT(assembler.node_pairs(), ElementsAre(NodePair{0, 4}, NodePair{1, 3}));
  EXPECT_EQ(reason_of([&] {
              assembler.add(chunk(v1::ARRAY_ID_NODE_PAIRS, 16, bytes_of<std::int32_t>({0, 1})));
            }),
            "ARRAY_SIZE_MISMATCH");
}

TEST_F(MeshAssemblerTest, TakesATargetSurfaceLast) {
  v1::SurfaceSpec spec;
  spec.set_point_count(3);
  spec.set_triangle_count(2);
  spec.set_patches_present(true);
  MeshLayout with_surface = layout();
  with_surface.expect_surface(spec, {});
  EXPECT_EQ(with_surface.total_bytes(), layout().total_bytes() + 72 + 24 + 8);
  EXPECT_EQ(with_surface.size().surface_triangles, 2);
  MeshAssembler assembler(with_surface);
  assembler.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  assembler.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));
  assembler.add(
      chunk(v1::ARRAY_ID_SURFACE_POINTS, 0, bytes_of<double>({0, 0, 0, 1, 0, 0, 0, 1, 0})));
  assembler.add(
      chunk(v1::ARRAY_ID_SURFACE_TRIANGLES, 0, bytes_of<std::int32_t>({0, 1, 2, 2, 1, 0})));
  EXPECT_EQ(reason_of([&] { assembler.finish(); }), "ARRAY_SIZE_MISMATCH");
  assembler.add(chunk(v1::ARRAY_ID_SURFACE_PATCHES, 0, bytes_of<std::int32_t>({7, 9})));
  assembler.finish();
  const std::optional<SurfaceMesh> surface = assembler.surface();
  ASSERT_TRUE(surface);
  EXPECT_EQ(surface->points[1], (Vec3d{1, 0, 0}));
  EXPECT_EQ(surface->triangles[1], (std::array<std::int32_t, 3>{2, 1, 0}));
  EXPECT_THAT(surface->patches, ElementsAre(7, 9));
}

TEST_F(MeshAssemblerTest, BoundsTheSizeOfATargetSurface) {
  const auto expect = [](std::int64_t points, std::int64_t triangles, MeshLimits limits = {}) {
    v1::SurfaceSpec spec;
    spec.set_point_count(points);
    spec.set_triangle_count(triangles);
    MeshLayout with_surface = layout();
    with_surface.expect_surface(spec, limits);
  };
  expect(3, 1);
  EXPECT_THROW(expect(0, 1), InvalidOption);
  EXPECT_THROW(expect(3, 0), InvalidOption);
  EXPECT_THROW(expect(-1, 1), InvalidOption);
  EXPECT_THROW(expect(INT64_MAX, 1), OutOfMemory);
  EXPECT_THROW(expect(3, INT64_MAX), OutOfMemory);
  expect(3, 1, {.max_mesh_bytes = 157 + 84});
  EXPECT_THROW(expect(3, 1, {.max_mesh_bytes = 157 + 83}), OutOfMemory);
}

TEST_F(MeshAssemblerTest, BoundsTheNumberOfNodePairs) {
  const auto expect = [](std::int64_t count, MeshLimits limits = {}) {
    MeshLayout with_pairs = layout();
    with_pairs.expect_node_pairs(count, limits);
  };
  expect(0);
  expect(40);
  EXPECT_THROW(expect(-1), InvalidOption);
  EXPECT_THROW(expect(41), InvalidOption);
  EXPECT_THROW(expect(INT64_MAX), InvalidOption);
  expect(2, {.max_mesh_bytes = 157 + 16});
  EXPECT_THROW(expect(2, {.max_mesh_bytes = 157 + 15}), OutOfMemory);
}

TEST_F(MeshAssemblerTest, TakesChunksThatCutNumbersInPieces) {
  for (std::size_t i = 0; i < kElements.size(); ++i) {
    assembler_.add(
        chunk(v1::ARRAY_ID_ELEMENTS, static_cast<std::int64_t>(i), kElements.substr(i, 1)));
  }

  EXPECT_EQ(assembler_.topology().blocks[0].nodes[7], 4);
}

TEST_F(MeshAssemblerTest, CutsBlocksFromOneArray) {
  MeshLayout two = layout();
  two.blocks = {{ElementType::tetrahedron, 1}, {ElementType::pyramid, 1}};
  two.elements_bytes = 36;
  MeshAssembler assembler(two);
  assembler.add(
      chunk(v1::ARRAY_ID_ELEMENTS, 0, bytes_of<std::int32_t>({0, 1, 2, 3, 4, 3, 2, 1, 0})));

  EXPECT_THAT(assembler.topology().blocks[0].nodes, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(assembler.topology().blocks[1].nodes, ElementsAre(4, 3, 2, 1, 0));
}

TEST_F(MeshAssemblerTest, RefusesAnArrayBeforeItsTurn) {
  EXPECT_EQ(add(v1::ARRAY_ID_COORDINATES, 0, kCoordinates), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, RefusesAnArrayThatWasNotAnnounced) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));

  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENT_REGIONS, 0, kElements), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, RefusesUnknownArrays) {
  EXPECT_EQ(add(v1::ARRAY_ID_UNSPECIFIED, 0, "x"), "CHUNK_OUT_OF_ORDER");
  EXPECT_EQ(add(static_cast<v1::ArrayId>(77), 0, "x"), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, RefusesAGap) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements.substr(0, 8)));

  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENTS, 12, kElements.substr(12)), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, RefusesAnOverlap) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements.substr(0, 8)));

  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENTS, 4, kElements.substr(4)), "CHUNK_OUT_OF_ORDER");
  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENTS, -8, kElements), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, RefusesMoreBytesThanAnnouncedInOneChunk) {
  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENTS, 0, kElements + "x"), "ARRAY_SIZE_MISMATCH");
}

TEST_F(MeshAssemblerTest, RefusesAChunkPastTheEndOfItsArray) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));

  EXPECT_EQ(add(v1::ARRAY_ID_ELEMENTS, 32, "more"), "ARRAY_SIZE_MISMATCH");
}

TEST_F(MeshAssemblerTest, RefusesDataAfterTheLastArray) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler_.add(chunk(v1::ARRAY_ID_FIXED_MASK, 0, kFixed));
  assembler_.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));

  EXPECT_EQ(add(v1::ARRAY_ID_COORDINATES, 120, "x"), "ARRAY_SIZE_MISMATCH");
  EXPECT_EQ(add(v1::ARRAY_ID_COORDINATES, 0, "x"), "CHUNK_OUT_OF_ORDER");
}

TEST_F(MeshAssemblerTest, SaysWhatIsMissingAtTheEnd) {
  assembler_.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements.substr(0, 8)));

  try {
    assembler_.finish();
    FAIL();
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
    EXPECT_THAT(error.details(), ElementsAre(::testing::Pair("array", "ARRAY_ID_ELEMENTS"),
                                             ::testing::Pair("offset_bytes", "8")));
  }
}

TEST_F(MeshAssemblerTest, ChecksAChecksumThatIsThere) {
  v1::Chunk good = chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements);
  good.set_crc32c(crc32c(std::as_bytes(std::span(kElements.data(), kElements.size()))));
  v1::Chunk bad = good;
  (*bad.mutable_data())[5] ^= 1;

  EXPECT_EQ(reason_of([&] { assembler_.add(bad); }), "CHECKSUM_MISMATCH");
  EXPECT_EQ(reason_of([&] { assembler_.add(good); }), "nothing thrown");
}

TEST_F(MeshAssemblerTest, LeavesOutArraysThatAreNotAnnounced) {
  MeshLayout without = layout();
  without.fixed_mask_bytes = 0;
  MeshAssembler assembler(without);
  assembler.add(chunk(v1::ARRAY_ID_ELEMENTS, 0, kElements));
  assembler.add(chunk(v1::ARRAY_ID_COORDINATES, 0, kCoordinates));

  EXPECT_TRUE(assembler.complete());
  EXPECT_TRUE(assembler.topology().fixed.empty());
  EXPECT_TRUE(assembler.topology().regions.empty());
}

class CountingResource : public std::pmr::memory_resource {
 public:
  std::size_t held_bytes = 0;
  std::size_t limit_bytes = SIZE_MAX;
  bool aligned = true;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (held_bytes + bytes > limit_bytes) throw std::bad_alloc();
    held_bytes += bytes;
    void* data = std::pmr::new_delete_resource()->allocate(bytes, alignment);
    aligned = aligned && reinterpret_cast<std::uintptr_t>(data) % 64 == 0;
    return data;
  }
  void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override {
    held_bytes -= bytes;
    std::pmr::new_delete_resource()->deallocate(data, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

TEST_F(MeshAssemblerTest, AllocatesExactlyWhatTheLayoutSaysAndGivesItBack) {
  CountingResource memory;
  {
    const MeshAssembler assembler(layout(), &memory);
    EXPECT_EQ(memory.held_bytes, 157U);
    EXPECT_TRUE(memory.aligned);
  }
  EXPECT_EQ(memory.held_bytes, 0U);
}

TEST_F(MeshAssemblerTest, GivesBackWhatItHasWhenMemoryRunsOut) {
  CountingResource memory;
  memory.limit_bytes = 100;

  EXPECT_THROW(MeshAssembler(layout(), &memory), std::bad_alloc);
  EXPECT_EQ(memory.held_bytes, 0U);
}

}  // namespace
}  // namespace meshsmooth::wire

#include "wire/mesh_layout.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth::wire {
namespace {

constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max();

v1::TopologySpec make_spec(std::int64_t node_count, std::int64_t tetrahedron_count) {
  v1::TopologySpec spec;
  spec.set_node_count(node_count);
  v1::ElementBlock* block = spec.add_element_blocks();
  block->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
  block->set_element_count(tetrahedron_count);
  return spec;
}

MeshLayout decode(const v1::TopologySpec& spec, const MeshLimits& limits = {}) {
  return decode_layout(spec, v1::SCALAR_TYPE_FLOAT64, limits);
}

// The reason of the error, and with a name the value of that detail.
template <class Function>
std::string thrown_by(const Function& function, const std::string& detail = "") {
  try {
    function();
  } catch (const Error& error) {
    if (detail.empty()) return error.reason();
    for (const auto& [key, value] : error.details()) {
      if (key == detail) return value;
    }
    return "no such detail";
  }
  return "nothing thrown";
}

TEST(MeshLayout, RefusesManyBlocksWithoutElements) {
  v1::TopologySpec spec = make_spec(10, 7);
  for (int i = 0; i < 64; ++i) {
    spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
  }
  EXPECT_EQ(decode(spec).element_count(), 7);
  spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
  EXPECT_EQ(thrown_by([&] { (void)decode(spec); }), "MESH_EMPTY");
}

// A listed job keeps them, and nothing counts them.
TEST(MeshLayout, RefusesMoreBlocksThanMeshesHave) {
  v1::TopologySpec spec = make_spec(10, 7);
  const auto add = [&] {
    spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    spec.mutable_element_blocks(spec.element_blocks_size() - 1)->set_element_count(1);
  };
  while (spec.element_blocks_size() < 4096) add();
  EXPECT_EQ(decode(spec).element_count(), 7 + 4095);
  add();
  EXPECT_EQ(thrown_by([&] { (void)decode(spec); }), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(thrown_by([&] { (void)decode(spec); }, "field"), "inline_topology.element_blocks");
}

TEST(MeshLayout, AddsUpTheBytesOfAllArrays) {
  v1::TopologySpec spec = make_spec(10, 7);
  spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_HEXAHEDRON);
  spec.mutable_element_blocks(1)->set_element_count(2);
  spec.set_fixed_mask_present(true);
  spec.set_element_regions_present(true);

  const MeshLayout layout = decode_layout(spec, v1::SCALAR_TYPE_FLOAT32, {});

  EXPECT_EQ(layout.elements_bytes, 7 * 16 + 2 * 32);
  EXPECT_EQ(layout.fixed_mask_bytes, 10);
  EXPECT_EQ(layout.element_regions_bytes, 9 * 4);
  EXPECT_EQ(layout.coordinates_bytes, 120);
  EXPECT_EQ(layout.total_bytes(), 176 + 10 + 36 + 120);
  EXPECT_EQ(layout.element_count(), 9);
  EXPECT_EQ(layout.size().element_counts[static_cast<std::size_t>(ElementType::hexahedron)], 2);
  EXPECT_FALSE(layout.size().float64);
  EXPECT_TRUE(layout.size().regions);
}

TEST(MeshLayout, HasNoTagsUnlessTheyAreAnnounced) {
  const MeshLayout layout = decode(make_spec(10, 7));

  EXPECT_EQ(layout.element_regions_bytes, 0);
  EXPECT_FALSE(layout.size().regions);
}

TEST(MeshLayout, RefusesAMeshWithoutNodesOrElements) {
  EXPECT_EQ(thrown_by([] { decode(make_spec(0, 1)); }), "MESH_EMPTY");
  EXPECT_EQ(thrown_by([] { decode(make_spec(4, 0)); }), "MESH_EMPTY");
  EXPECT_EQ(thrown_by([] { decode(v1::TopologySpec()); }), "MESH_EMPTY");
}

TEST(MeshLayout, RefusesNegativeCountsByTheirField) {
  EXPECT_EQ(thrown_by([] { decode(make_spec(-1, 1)); }), "OPTION_OUT_OF_RANGE");
  EXPECT_EQ(thrown_by([] { decode(make_spec(-1, 1)); }, "field"), "inline_topology.node_count");
  EXPECT_EQ(thrown_by([] { decode(make_spec(4, -5)); }, "field"),
            "inline_topology.element_blocks.element_count");
}

TEST(MeshLayout, RefusesCountsThatOverflowWhateverTheLimits) {
  const MeshLimits no_limits{
      .max_node_count = kHuge, .max_element_count = kHuge, .max_mesh_bytes = kHuge - 1};

  EXPECT_EQ(thrown_by([&] { decode(make_spec(4, kHuge / 16 + 1), no_limits); }), "MESH_TOO_LARGE");
  EXPECT_EQ(thrown_by([&] { decode(make_spec(kHuge / 24 + 1, 1), no_limits); }), "MESH_TOO_LARGE");
}

TEST(MeshLayout, RefusesBlocksWhoseSumOverflows) {
  v1::TopologySpec spec = make_spec(4, kHuge);
  *spec.add_element_blocks() = spec.element_blocks(0);
  const MeshLimits no_limits{
      .max_node_count = kHuge, .max_element_count = kHuge - 1, .max_mesh_bytes = kHuge - 1};

  EXPECT_EQ(thrown_by([&] { decode(spec, no_limits); }), "MESH_TOO_LARGE");
}

TEST(MeshLayout, RefusesWhatIsAboveALimitAndSaysBothNumbers) {
  const auto nodes = [] { decode(make_spec(11, 1), {.max_node_count = 10}); };
  EXPECT_EQ(thrown_by(nodes, "need_nodes"), "11");
  EXPECT_EQ(thrown_by(nodes, "limit_nodes"), "10");

  const auto elements = [] { decode(make_spec(4, 3), {.max_element_count = 2}); };
  EXPECT_EQ(thrown_by(elements, "need_elements"), "3");

  const auto bytes = [] { decode(make_spec(4, 1), {.max_mesh_bytes = 111}); };
  EXPECT_EQ(thrown_by(bytes, "need_bytes"), "112");
  EXPECT_NO_THROW(decode(make_spec(4, 1), {.max_mesh_bytes = 112}));

  v1::TopologySpec with_regions = make_spec(4, 1);
  with_regions.set_element_regions_present(true);
  EXPECT_EQ(thrown_by([&] { decode(with_regions, {.max_mesh_bytes = 115}); }, "need_bytes"), "116");
}

TEST(MeshLayout, RefusesSurfaceAndVolumeElementsTogether) {
  v1::TopologySpec spec = make_spec(4, 1);
  spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TRIANGLE);
  spec.mutable_element_blocks(1)->set_element_count(1);

  EXPECT_EQ(thrown_by([&] { decode(spec); }), "MIXED_DIMENSIONS");
}

TEST(MeshLayout, RefusesUnknownTypes) {
  v1::TopologySpec spec = make_spec(4, 1);
  EXPECT_EQ(thrown_by([&] { (void)decode_layout(spec, v1::SCALAR_TYPE_INT32, {}); }, "field"),
            "coordinate_type");

  spec.mutable_element_blocks(0)->set_element_type(static_cast<v1::ElementType>(99));
  EXPECT_EQ(thrown_by([&] { decode(spec); }), "OPTION_NOT_SUPPORTED");
}

TEST(MeshLayout, ReadsWhatASenderAnnounces) {
  Mesh mesh;
  mesh.positions = std::vector<Vec3f>(5);
  mesh.blocks = {{ElementType::tetrahedron, {0, 1, 2, 3}}, {ElementType::pyramid, {0, 1, 2, 3, 4}}};
  mesh.fixed = {0, 0, 0, 0, 1};
  mesh.regions = {7, -7};

  const MeshLayout layout =
      decode_layout(encode_topology_spec(MeshTopology(mesh).view()), v1::SCALAR_TYPE_FLOAT32, {});

  EXPECT_EQ(layout.node_count, 5);
  ASSERT_EQ(layout.blocks.size(), 2U);
  EXPECT_EQ(layout.blocks[1].type, ElementType::pyramid);
  EXPECT_EQ(layout.elements_bytes, 36);
  EXPECT_EQ(layout.fixed_mask_bytes, 5);
  EXPECT_EQ(layout.element_regions_bytes, 8);
}

// A job that names its topology needs the memory of one that sends it.
TEST(MeshLayout, OfCoordinatesAloneIsOfTheSameSize) {
  v1::TopologySpec spec;
  spec.set_node_count(5);
  spec.add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
  spec.mutable_element_blocks(0)->set_element_count(2);
  spec.set_fixed_mask_present(true);
  spec.set_element_regions_present(true);
  const MeshLayout whole = decode_layout(spec, v1::SCALAR_TYPE_FLOAT64, {});

  const MeshLayout alone = whole.coordinates_only(false);

  EXPECT_EQ(alone.total_bytes(), 5 * 12);
  EXPECT_EQ(alone.size().node_count, whole.size().node_count);
  EXPECT_EQ(alone.size().element_counts, whole.size().element_counts);
  EXPECT_TRUE(alone.size().regions);
  EXPECT_FALSE(alone.size().float64);
}

}  // namespace
}  // namespace meshsmooth::wire

#include "meshsmooth/mesh.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "meshsmooth/error.hpp"
#include "support/meshes.hpp"

namespace meshsmooth {
namespace {

using test::points;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

/// What `validate` throws on the mesh.
InvalidMesh error_of(const Mesh& mesh) {
  try {
    validate(MeshTopology(mesh).view(), mesh.positions_view());
  } catch (const InvalidMesh& error) {
    return error;
  }
  return {"", "the mesh is valid"};
}

Mesh two_blocks(ElementType first, ElementType second) {
  Mesh mesh = test::single(first);
  const Mesh other = test::single(second);
  const auto offset = static_cast<NodeId>(points(mesh).size());
  points(mesh).insert(points(mesh).end(), points(other).begin(), points(other).end());
  mesh.blocks.push_back(other.blocks[0]);
  for (NodeId& n : mesh.blocks[1].nodes) n += offset;
  return mesh;
}

TEST(ValidateMesh, AcceptsEveryElementTypeInBothPrecisions) {
  for (const ElementType type : kLinearTypes) {
    const Mesh mesh = test::lattice(type, 3);

    EXPECT_STREQ(error_of(mesh).what(), "the mesh is valid");
    EXPECT_STREQ(error_of(test::as_float32(mesh)).what(), "the mesh is valid");
  }
}

TEST(ValidateMesh, AcceptsIsolatedNodesDisconnectedPiecesAndMixedTypes) {
  EXPECT_STREQ(error_of(test::with_isolated_node(test::two_tets())).what(), "the mesh is valid");
  EXPECT_STREQ(error_of(test::disconnected_pieces()).what(), "the mesh is valid");
  EXPECT_STREQ(error_of(test::mixed_stack(2)).what(), "the mesh is valid");
  EXPECT_STREQ(error_of(test::inverted(test::two_tets())).what(), "the mesh is valid");
}

TEST(ValidateMesh, NamesAMeshWithoutNodes) {
  const InvalidMesh error = error_of(Mesh{});

  EXPECT_EQ(error.reason(), "MESH_EMPTY");
  EXPECT_STREQ(error.what(), "the mesh has no nodes");
}

TEST(ValidateMesh, NamesAMeshWithoutElements) {
  const InvalidMesh no_block = error_of(test::make_mesh({{0, 0, 0}}, {}));
  const InvalidMesh empty_block = error_of(test::make_mesh({{0, 0, 0}}, {{ElementType::quad, {}}}));

  EXPECT_EQ(no_block.reason(), "MESH_EMPTY");
  EXPECT_STREQ(no_block.what(), "the mesh has no elements");
  EXPECT_EQ(empty_block.reason(), "MESH_EMPTY");
}

TEST(ValidateMesh, AcceptsAnEmptyBlockBesideOthers) {
  Mesh mesh = test::two_tets();
  mesh.blocks.insert(mesh.blocks.begin(), {ElementType::hexahedron, {}});

  EXPECT_STREQ(error_of(mesh).what(), "the mesh is valid");
}

TEST(ValidateMesh, NamesABlockThatEndsInsideAnElement) {
  Mesh mesh = test::two_tets();
  mesh.blocks[0].nodes.pop_back();

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
  EXPECT_STREQ(error.what(), "block 0 (tetrahedron) has 7 nodes, that is no multiple of 4");
}

TEST(ValidateMesh, NamesPositionsOfAnotherCount) {
  const Mesh mesh = test::two_tets();
  const Mesh other = test::single(ElementType::tetrahedron);
  try {
    validate(MeshTopology(mesh).view(), other.positions_view());
    FAIL() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
    EXPECT_STREQ(error.what(), "the mesh has 5 nodes but 4 positions");
  }
}

TEST(ValidateMesh, NamesAFixedMaskOfAnotherSize) {
  Mesh mesh = test::two_tets();
  mesh.fixed.assign(4, 0);

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
  EXPECT_STREQ(error.what(), "the fixed mask has 4 bytes, the mesh has 5 nodes");
}

TEST(ValidateMesh, NamesRegionsOfAnotherSize) {
  Mesh mesh = test::two_tets();
  mesh.regions.assign(3, 0);

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
  EXPECT_STREQ(error.what(), "the mesh has regions for 3 elements, but 2 elements");
}

TEST(ValidateMesh, NamesMoreNodesThanIdsCanCount) {
  const Mesh mesh = test::two_tets();
  const std::vector<ElementBlockView> blocks = mesh.block_views();
  try {
    validate({std::size_t{1} << 31, blocks, {}}, mesh.positions_view());
    FAIL() << "nothing thrown";
  } catch (const InvalidMesh& error) {
    EXPECT_EQ(error.reason(), "ARRAY_SIZE_MISMATCH");
    EXPECT_STREQ(error.what(), "the mesh has 2147483648 nodes, node ids are 32-bit");
  }
}

TEST(ValidateMesh, NamesBlocksOfDifferentDimension) {
  const InvalidMesh error = error_of(two_blocks(ElementType::hexahedron, ElementType::quad));

  EXPECT_EQ(error.reason(), "MIXED_DIMENSIONS");
  EXPECT_THAT(error.what(), HasSubstr("block 1 (quad) and block 0 (hexahedron)"));
}

TEST(ValidateMesh, NamesTheElementWhoseNodeIsOutOfRange) {
  Mesh mesh = test::two_tets();
  mesh.blocks[0].nodes[6] = 5;

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "INDEX_OUT_OF_RANGE");
  EXPECT_STREQ(error.what(),
               "element 1 (tetrahedron): node 5 is out of range, the mesh has 5 nodes");
  EXPECT_THAT(error.details(), ElementsAre(Pair("element", "1"), Pair("node", "5")));
}

TEST(ValidateMesh, NamesANegativeNode) {
  Mesh mesh = test::two_tets();
  mesh.blocks[0].nodes[0] = -1;

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "INDEX_OUT_OF_RANGE");
  EXPECT_STREQ(error.what(),
               "element 0 (tetrahedron): node -1 is out of range, the mesh has 5 nodes and they "
               "count from 0");
}

TEST(ValidateMesh, NamesARepeatedNodeInAnyPairOfPlaces) {
  for (const ElementType type : kLinearTypes) {
    const Mesh good = test::single(type);
    const auto width = static_cast<int>(good.blocks[0].nodes.size());
    for (int a = 0; a < width; ++a) {
      for (int b = a + 1; b < width; ++b) {
        Mesh mesh = good;
        mesh.blocks[0].nodes[b] = a;

        const InvalidMesh error = error_of(mesh);

        EXPECT_EQ(error.reason(), "REPEATED_NODE");
        EXPECT_EQ(error.what(), "element 0 (" + std::string(element_name(type)) + "): node " +
                                    std::to_string(a) + " occurs more than once");
        EXPECT_THAT(error.details(),
                    ElementsAre(Pair("element", "0"), Pair("node", std::to_string(a))));
      }
    }
  }
}

TEST(ValidateMesh, CountsElementsThroughAllBlocks) {
  Mesh mesh = two_blocks(ElementType::wedge, ElementType::pyramid);
  mesh.blocks[1].nodes[2] = mesh.blocks[1].nodes[4];

  EXPECT_THAT(error_of(mesh).what(), HasSubstr("element 1 (pyramid): node 10 occurs"));
}

TEST(ValidateMesh, NamesTheLowestOfManyWrongElements) {
  Mesh mesh = test::lattice(ElementType::tetrahedron, 20);
  ASSERT_EQ(mesh.element_count(), 48000U);
  for (const std::size_t e : {47999U, 31234U, 12345U, 40000U}) mesh.blocks[0].nodes[4 * e] = 9261;
  mesh.blocks[0].nodes[4 * 31233 + 1] = mesh.blocks[0].nodes[4 * 31233];

  EXPECT_THAT(error_of(mesh).details().front(), Pair("element", "12345"));
}

TEST(ValidateMesh, NamesTheLowestNodeThatIsNotFinite) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Mesh mesh = test::two_tets();
  points(mesh)[4].x = kNan;
  points(mesh)[3].z = -kInfinity;

  const InvalidMesh error = error_of(mesh);

  EXPECT_EQ(error.reason(), "NON_FINITE_COORDINATE");
  EXPECT_STREQ(error.what(), "node 3: its position (0.3, 0.3, -inf) is not finite");
  EXPECT_THAT(error.details(), ElementsAre(Pair("node", "3")));
  EXPECT_EQ(error_of(test::as_float32(mesh)).reason(), "NON_FINITE_COORDINATE");
}

TEST(Mesh, CountsItsNodesAndElements) {
  const Mesh mesh = test::mixed_stack(2);

  EXPECT_EQ(mesh.node_count(), 40U);
  EXPECT_EQ(mesh.element_count(), 4U * (1 + 1 + 10 + 2));
  EXPECT_EQ(MeshTopology(mesh).view().element_count(), mesh.element_count());
  EXPECT_EQ(position_count(mesh.positions_view()), 40U);
  EXPECT_EQ(Mesh{}.node_count(), 0U);
  EXPECT_THAT(Mesh{}.block_views(), IsEmpty());
}

TEST(Mesh, SpansItsOwnPositions) {
  Mesh mesh = test::as_float32(test::two_tets());

  std::get<std::span<Vec3f>>(mesh.positions_span())[1].x = 7;

  EXPECT_EQ(std::get<std::vector<Vec3f>>(mesh.positions)[1].x, 7);
  EXPECT_EQ(std::get<std::span<const Vec3f>>(as_view(mesh.positions_span()))[1].x, 7);
}

}  // namespace
}  // namespace meshsmooth

// Reading a file and writing it to the same format.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "generate/generate.hpp"
#include "meshsmooth/quality.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::expect_same_connectivity;
using test::fixture;
using test::move_nodes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

MeshFile write_and_read(const std::filesystem::path& path, const MeshFile& file) {
  write_mesh_file(path, file);
  return read_mesh_file(path);
}

// --- files of which every byte but the coordinates stays -----------------------

std::vector<const char*> kept_texts() {
  std::vector<const char*> names = {"tetgen.node", "second_order.node", "roof.obj", "tile.ply",
                                    "tile_big_endian.ply"};
#if defined(MESHSMOOTH_WITH_GMSH)
  names.insert(names.end(), {"groups.msh", "mixed.msh", "mixed_v2.msh", "mixed_binary.msh",
                             "mixed_binary_v2.msh", "second_order.msh", "second_order_v2.msh",
                             "quadratic.msh", "box.mesh", "box.unv", "plate.bdf"});
#endif
  return names;
}

class KeptText : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(RoundTrip, KeptText, ::testing::ValuesIn(kept_texts()),
                         [](const auto& param) {
                           std::string name = param.param;
                           for (char& letter : name) letter = letter == '.' ? '_' : letter;
                           return name;
                         });

TEST_P(KeptText, GivesTheSameBytesWhenNothingMoved) {
  const Scratch scratch;
  const auto out = scratch.path(GetParam());
  write_mesh_file(out, read_mesh_file(fixture(GetParam())));
  EXPECT_EQ(bytes_of(out), bytes_of(fixture(GetParam())));
}

TEST_P(KeptText, KeepsMovedNodesBitIdenticalAndTheRest) {
  const Scratch scratch;
  const MeshFile before = read_mesh_file(fixture(GetParam()));
  MeshFile moved = before;
  move_nodes(moved.mesh);
  const MeshFile after = write_and_read(scratch.path(GetParam()), moved);

  if (std::string(GetParam()) != "plate.bdf") {  // its columns are too narrow
    EXPECT_TRUE(after.mesh.positions == moved.mesh.positions);
  }
  expect_same_connectivity(before.mesh, after.mesh);
  EXPECT_EQ(before.lower_dimensional_nodes(), after.lower_dimensional_nodes());
  EXPECT_EQ(before.lower_dimensional_cell_count(), after.lower_dimensional_cell_count());
  for (std::size_t node = 0; node < before.mesh.node_count(); ++node) {
    const auto id = static_cast<std::int64_t>(node);
    EXPECT_EQ(before.file_node_id(id), after.file_node_id(id));
  }
  for (std::size_t element = 0; element < before.mesh.element_count(); ++element) {
    const auto id = static_cast<std::int64_t>(element);
    EXPECT_EQ(before.file_element_id(id), after.file_element_id(id));
  }
  // And moving back gives the mesh as it was.
  MeshFile back = after;
  back.mesh.positions = before.mesh.positions;
  const MeshFile again = write_and_read(scratch.path(GetParam()), back);
  EXPECT_TRUE(again.mesh.positions == before.mesh.positions);
}

#if defined(MESHSMOOTH_WITH_GMSH)

TEST(Nastran, KeepsAsManyDigitsAsTheColumnsHold) {
  const Scratch scratch;
  MeshFile file = read_mesh_file(fixture("plate.bdf"));
  auto& nodes = std::get<std::vector<Vec3d>>(file.mesh.positions);
  EXPECT_EQ(nodes[2].z, -1.5e-3);  // "-1.5-3"
  nodes[0].x = 1.0 / 3;
  nodes[1].x = -1234567.0 / 3;
  nodes[4].x = 1.0 / 3;  // between commas: all digits
  const auto out = scratch.path("out.bdf");
  const MeshFile after = write_and_read(out, file);
  const auto& read = std::get<std::vector<Vec3d>>(after.mesh.positions);
  EXPECT_NEAR(read[0].x, nodes[0].x, 1e-7);
  EXPECT_NEAR(read[1].x, nodes[1].x, 1);
  EXPECT_EQ(read[4].x, nodes[4].x);
  EXPECT_NE(bytes_of(out).find("MAT1    1       2.1+11"), std::string::npos);
}

// Readers of UNV go by columns: a sign must not push the next number out of its own.
TEST(Unv, KeepsTheColumnsOfItsNumbers) {
  const Scratch scratch;
  MeshFile file = read_mesh_file(fixture("box.unv"));
  auto& nodes = std::get<std::vector<Vec3d>>(file.mesh.positions);
  for (Vec3d& node : nodes) node = {-1.5, -2.5e-100, -3.5};

  write_mesh_file(scratch.path("a.unv"), file);

  const std::string before = bytes_of(fixture("box.unv"));
  const std::string after = bytes_of(scratch.path("a.unv"));
  EXPECT_EQ(after.size(), before.size());
  EXPECT_EQ(std::ranges::count(after, '\n'), std::ranges::count(before, '\n'));
  EXPECT_THAT(after, HasSubstr("  -1.5000000000000000D+00 -2.5000000000000000D-100  "
                               "-3.5000000000000000D+00\n"));
}

// A number of any length is replaced.
TEST(Unv, TakesNumbersOfAnyLength) {
  const Scratch scratch;
  std::string text = bytes_of(fixture("box.unv"));
  const std::string first = "D+00";
  const auto place = text.find(first, text.find("2411"));
  text.insert(place, std::string(100, '0'));
  test::put_bytes(scratch.path("a.unv"), text);
  MeshFile file = read_mesh_file(scratch.path("a.unv"));
  move_nodes(file.mesh);

  write_mesh_file(scratch.path("b.unv"), file);

  EXPECT_TRUE(read_mesh_file(scratch.path("b.unv")).mesh.positions == file.mesh.positions);
}

TEST(Gmsh, GivesNodesInTheFilesOrderWithIdsAndIsolatedOnes) {
  const MeshFile file = read_mesh_file(fixture("groups.msh"));
  ASSERT_EQ(file.mesh.node_count(), 6u);
  EXPECT_EQ(file.file_node_id(0), 10);
  EXPECT_EQ(file.file_node_id(5), 99);  // in no element
  EXPECT_EQ(file.find_node(50), 4);
  EXPECT_EQ(file.find_node(51), std::nullopt);
  EXPECT_EQ(file.file_element_id(0), 205);
  EXPECT_EQ(file.file_element_id(1), 207);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 1);
  EXPECT_THAT(file.lower_dimensional_nodes(), ElementsAre(0, 1, 2));
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 3, 1, 4, 2, 3));
}

class MixedByGmsh : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(RoundTrip, MixedByGmsh,
                         ::testing::Values("mixed.msh", "mixed_v2.msh", "mixed_binary.msh",
                                           "mixed_binary_v2.msh"));

// Gmsh's mesh is valid and fills three unit cubes: a wrong node order of any
// type would show as inverted elements.
TEST_P(MixedByGmsh, HasEveryVolumeTypeTheRightWayRound) {
  const MeshFile file = read_mesh_file(fixture(GetParam()));
  std::vector<std::size_t> counts(kLinearTypeCount);
  for (const ElementBlock& block : file.mesh.blocks) {
    counts[static_cast<std::size_t>(block.type)] = block.nodes.size() / element_width(block.type);
  }
  EXPECT_THAT(counts, ElementsAre(0, 0, 236, 9, 78, 27));
  const QualityStats quality = measure_quality(file.mesh);
  EXPECT_EQ(quality.inverted_count, 0);
  EXPECT_EQ(quality.degenerate_count, 0);
  EXPECT_NEAR(quality.sum_absolute_volume, 3, 1e-12);
}

#endif

TEST(TetGen, KeepsNumbersFromOne) {
  const MeshFile file = read_mesh_file(fixture("tetgen.ele"));
  EXPECT_EQ(file.file_node_id(0), 1);
  EXPECT_EQ(file.file_element_id(11), 12);
  EXPECT_EQ(file.find_node(0), std::nullopt);
  EXPECT_EQ(file.find_node(9), 8);
}

TEST(Obj, SharesNodesAcrossTextureSeamsAndCountsBack) {
  const MeshFile file = read_mesh_file(fixture("roof.obj"));
  EXPECT_EQ(file.mesh.node_count(), 6u);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.mesh.blocks[1].nodes, ElementsAre(1, 4, 5, 1, 5, 2));
  EXPECT_THAT(file.lower_dimensional_nodes(), ElementsAre(0, 3));
}

// --- generated meshes through every format that can carry them ----------------

struct Carrier {
  const char* name;
  Mesh (*generate)();
};

void PrintTo(const Carrier& carrier, std::ostream* out) { *out << carrier.name; }

class Carriers : public ::testing::TestWithParam<Carrier> {};

Mesh mixed() { return generate_mixed(200, 3); }
Mesh sphere() { return generate_sphere(100, 3); }
Mesh square() { return generate_square(100, 3); }
#if defined(MESHSMOOTH_WITH_TETGEN)
Mesh cube() { return generate_cube(200, 3); }
#endif

std::vector<Carrier> carriers() {
  std::vector<Carrier> cases = {{"a.vtu", mixed},  {"a.vtk", mixed},  {"a.vtu", square},
                                {"a.vtk", sphere}, {"a.vtp", sphere}, {"a.obj", sphere}};
#if defined(MESHSMOOTH_WITH_TETGEN)
  cases.push_back({"a.node", cube});
#endif
#if defined(MESHSMOOTH_WITH_GMSH)
  cases.insert(cases.end(), {{"a.msh", mixed},
                             {"a.msh", sphere},
                             {"a.mesh", sphere},
                             {"a.mesh", mixed},
                             {"a.meshb", mixed}});
#endif
#if defined(MESHSMOOTH_WITH_GMSH) && defined(MESHSMOOTH_WITH_TETGEN)
  cases.insert(cases.end(), {{"a.mesh", cube}, {"a.unv", cube}});
#endif
  return cases;
}

INSTANTIATE_TEST_SUITE_P(RoundTrip, Carriers, ::testing::ValuesIn(carriers()),
                         [](const auto& param) {
                           return std::string(param.param.name).substr(2) + "_" +
                                  std::to_string(param.index);
                         });

TEST_P(Carriers, KeepFloat64BitIdenticalAndConnectivity) {
  const Scratch scratch;
  const MeshFile file(GetParam().generate());
  const MeshFile after = write_and_read(scratch.path(GetParam().name), file);
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  ASSERT_EQ(after.mesh.element_count(), file.mesh.element_count());
  EXPECT_EQ(measure_quality(after.mesh).inverted_count, 0);
  // A format may order the types in its own way.
  for (const ElementBlock& block : file.mesh.blocks) {
    const auto same = std::find_if(after.mesh.blocks.begin(), after.mesh.blocks.end(),
                                   [&](const auto& other) { return other.type == block.type; });
    ASSERT_NE(same, after.mesh.blocks.end());
    EXPECT_EQ(same->nodes, block.nodes);
  }
}

class FloatCarriers : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(RoundTrip, FloatCarriers,
                         ::testing::Values("a.vtu", "a.vtk", "a.vtp", "a.ply", "a.stl"));

TEST_P(FloatCarriers, KeepFloat32BitIdenticalAsFloat32) {
  const Scratch scratch;
  Mesh mesh = generate_sphere(100, 5);
  std::vector<Vec3f> nodes;
  for (const Vec3d& node : std::get<std::vector<Vec3d>>(mesh.positions)) {
    nodes.push_back(vec3_cast<float>(node));
  }
  mesh.positions = nodes;
  const MeshFile after = write_and_read(scratch.path(GetParam()), MeshFile(mesh));
  ASSERT_TRUE(std::holds_alternative<std::vector<Vec3f>>(after.mesh.positions));
  if (std::string(GetParam()) == "a.stl") {  // has no shared nodes; VTK joins them again
    EXPECT_EQ(after.mesh.node_count(), mesh.node_count());
    EXPECT_EQ(after.mesh.element_count(), mesh.element_count());
    EXPECT_EQ(measure_quality(after.mesh).sum_absolute_volume,
              measure_quality(mesh).sum_absolute_volume);
    return;
  }
  EXPECT_TRUE(after.mesh.positions == mesh.positions);
  expect_same_connectivity(after.mesh, mesh);
}

TEST(WriteMeshFile, ReplacesTheFileItWasReadFrom) {
  const Scratch scratch;
  const auto path = scratch.path("same.vtu");
  write_mesh_file(path, MeshFile(mixed()));
  MeshFile file = read_mesh_file(path);
  move_nodes(file.mesh);
  write_mesh_file(path, file);
  EXPECT_TRUE(read_mesh_file(path).mesh.positions == file.mesh.positions);
  EXPECT_EQ(scratch.file_count(), 1u);  // no unfinished file stays
}

TEST(WriteMeshFile, TakesAChangedPrecision) {
  const Scratch scratch;
  const auto path = scratch.path("a.vtu");
  write_mesh_file(path, MeshFile(mixed()));
  MeshFile file = read_mesh_file(path);
  file.mesh.positions = std::vector<Vec3f>(file.mesh.node_count(), Vec3f{1, 2, 3});
  const MeshFile after = write_and_read(path, file);
  EXPECT_TRUE(std::holds_alternative<std::vector<Vec3f>>(after.mesh.positions));
}

TEST(WriteMeshFile, RefusesAnotherNumberOfNodes) {
  const Scratch scratch;
  const auto path = scratch.path("a.vtu");
  write_mesh_file(path, MeshFile(mixed()));
  MeshFile file = read_mesh_file(path);
  std::get<std::vector<Vec3d>>(file.mesh.positions).pop_back();
  EXPECT_THROW(write_mesh_file(scratch.path("b.vtu"), file), InvalidMesh);
}

}  // namespace
}  // namespace meshsmooth::formats

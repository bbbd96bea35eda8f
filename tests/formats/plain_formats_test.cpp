// The formats without third-party libraries, in builds with VTK and without.

#include <gmock/gmock.h>

#include <algorithm>

#include "generate/generate.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/error.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::Scratch;
using ::testing::HasSubstr;

class PlainFormats : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(OfSurfaces, PlainFormats, ::testing::Values("a.ply", "a.obj"),
                         [](const auto& param) { return std::string(param.param).substr(2); });

TEST_P(PlainFormats, KeepFloat64BitIdenticalThroughOneAnother) {
  const Scratch scratch;
  const MeshFile file(generate_sphere(100, 3));
  write_mesh_file(scratch.path(GetParam()), file);
  for (const char* other : {"b.ply", "b.obj"}) {
    write_mesh_file(scratch.path(other), read_mesh_file(scratch.path(GetParam())));

    const MeshFile after = read_mesh_file(scratch.path(other));

    EXPECT_TRUE(after.mesh.positions == file.mesh.positions) << other;
    test::expect_same_connectivity(after.mesh, file.mesh);
  }
}

TEST(PlainFormats, CarryTetrahedra) {
  const Scratch scratch;
  const MeshFile file = read_mesh_file(test::fixture("tetgen.node"));

  // As a file of its own, with nothing of the other's text.
  write_mesh_file(scratch.path("a.ele"), MeshFile(file.mesh));

  const MeshFile after = read_mesh_file(scratch.path("a.node"));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  test::expect_same_connectivity(after.mesh, file.mesh);
}

/// What reading such a file says.
std::string error_of_file(const std::string& name, const std::string& bytes) {
  const Scratch scratch;
  test::put_bytes(scratch.path(name), bytes);
  return test::error_of([&] { static_cast<void>(read_mesh_file(scratch.path(name))); }).second;
}

std::string ply_with_face(const std::string& type, const std::string& face) {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
         "property double z\nelement face 1\nproperty list uchar " +
         type + " vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 " + face + "\n";
}

TEST(PlainFormats, RefuseNodesThatNoNumberNames) {
  for (const char* face : {"0 1 nan", "0 1 1e300", "0 -1e300 2", "0 1 1.5", "0 1 4294967298"}) {
    EXPECT_THAT(error_of_file("a.ply", ply_with_face("double", face)),
                HasSubstr("expected the number of a vertex"))
        << face;
  }
}

// 4294967297 is not 1.
TEST(PlainFormats, DoNotTakeAnOverflowForANode) {
  EXPECT_THAT(error_of_file("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 4294967297 2 3\n"),
              HasSubstr("element 0 uses node 4294967296, there are only 3"));
}

// Its columns of data would be shorter than the list of nodes.
TEST(PlainFormats, RefuseTwoListsOfVertices) {
  const std::string vertices =
      "element vertex 1\nproperty double x\nproperty double y\nproperty double z\n";
  EXPECT_THAT(error_of_file("a.ply", "ply\nformat ascii 1.0\n" + vertices + "property int mark\n" +
                                         vertices + "end_header\n0 0 0 1\n1 0 0\n"),
              HasSubstr("expected one list of vertices"));
}

// The nodes after the second would all have been taken for their neighbours.
TEST(PlainFormats, RefuseTwoNodesOfOneNumber) {
  const Scratch scratch;
  test::put_bytes(scratch.path("a.node"), "5 3 0 0\n1 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 1 1 1\n");
  test::put_bytes(scratch.path("a.ele"), "1 4 0\n1 1 2 3 4\n");

  const auto [reason, text] =
      test::error_of([&] { static_cast<void>(read_mesh_file(scratch.path("a.node"))); });

  EXPECT_EQ(reason, "FORMAT_ERROR");
  EXPECT_THAT(text, HasSubstr("two nodes have the number 1"));
}

TEST(PlainFormats, AreKnownInEveryBuild) {
  for (const char* extension : {".ply", ".obj", ".inp", ".su2", ".foam", ".node", ".ele"}) {
    EXPECT_THAT(readable_extensions(), HasSubstr(extension));
    EXPECT_THAT(writable_extensions(), HasSubstr(extension));
  }
}

#if !defined(MESHSMOOTH_WITH_VTK)
TEST(BuildWithoutVtk, SaysSoWhenOneOfItsFormatsIsAskedFor) {
  const Scratch scratch;
  test::put_bytes(scratch.path("a.vtu"), "<VTKFile>");
  for (const auto& [reason, text] :
       {test::error_of([&] { static_cast<void>(read_mesh_file(scratch.path("a.vtu"))); }),
        test::error_of([&] { check_writable(scratch.path("a.stl")); })}) {
    EXPECT_EQ(reason, "FORMAT_UNKNOWN");
    EXPECT_THAT(
        text,
        HasSubstr("this build is without VTK; known are .ply .obj .inp .su2 .foam .node .ele"));
  }
  EXPECT_THAT(readable_extensions(), ::testing::StartsWith(".ply .obj .inp .su2 .foam .node .ele"));
}
#endif

#if !defined(MESHSMOOTH_WITH_HDF5)
TEST(BuildWithoutHdf5, SaysSoWhenOneOfItsFormatsIsAskedFor) {
  for (const char* name : {"a.med", "a.cgns", "a.exo", "a.xdmf"}) {
    const auto [reason, text] = test::error_of([&] { check_writable(name); });
    EXPECT_EQ(reason, "FORMAT_UNKNOWN");
    EXPECT_THAT(text, HasSubstr("this build is without HDF5"));
  }
}
#endif

#if !defined(MESHSMOOTH_WITH_GMSH)
TEST(BuildWithoutGmsh, SaysSoWhenOneOfItsFormatsIsAskedFor) {
  const auto [reason, text] = test::error_of([] { check_writable("a.msh", "a.ply"); });
  EXPECT_EQ(reason, "FORMAT_UNKNOWN");
  EXPECT_THAT(text, HasSubstr("this build is without Gmsh"));
}
#endif

}  // namespace
}  // namespace meshsmooth::formats

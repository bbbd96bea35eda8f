// The formats that stand on no library, in builds with VTK and without.

#include <gmock/gmock.h>

#include <algorithm>

#include "generate.hpp"
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

TEST(PlainFormats, AreKnownInEveryBuild) {
  for (const char* extension : {".ply", ".obj", ".node", ".ele"}) {
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
    EXPECT_THAT(text, HasSubstr("this build is without VTK; known are .ply .obj .node .ele"));
  }
  EXPECT_EQ(readable_extensions(), ".ply .obj .node .ele");
}
#endif

#if !defined(MESHSMOOTH_WITH_GMSH)
TEST(BuildWithoutGmsh, SaysSoWhenOneOfItsFormatsIsAskedFor) {
  const auto [reason, text] = test::error_of([] { check_writable("a.msh"); });
  EXPECT_EQ(reason, "FORMAT_UNKNOWN");
  EXPECT_THAT(text, HasSubstr("this build is without Gmsh"));
}
#endif

}  // namespace
}  // namespace meshsmooth::formats

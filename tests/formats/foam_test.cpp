// Meshes of OpenFOAM.

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>

#include "content.hpp"
#include "foam_reader.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"
#include "readers.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;
using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::fixture;
using test::pairs_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Foam : public ::testing::Test {
 protected:
  Foam() {
    std::filesystem::copy(fixture("foam"), case_, std::filesystem::copy_options::recursive);
  }

  [[nodiscard]] path mesh_file(const std::string& name) const {
    return case_ / "constant" / "polyMesh" / name;
  }
  void replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = bytes_of(mesh_file(name));
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    put_bytes(mesh_file(name), text.replace(at, from.size(), to));
  }
  [[nodiscard]] std::pair<std::string, std::string> error() const {
    return error_of([&] { static_cast<void>(read_mesh_file(case_)); });
  }

  const Scratch scratch_;
  const path case_ = scratch_.path("case");
};

TEST_F(Foam, RecognizesCellsByTheirFaces) {
  const MeshFile file = read_mesh_file(case_);

  EXPECT_EQ(file.mesh.node_count(), 16U);
  ASSERT_EQ(file.mesh.blocks.size(), 4U);
  EXPECT_EQ(file.mesh.blocks[0].type, ElementType::hexahedron);
  EXPECT_EQ(file.mesh.blocks[1].type, ElementType::wedge);
  EXPECT_EQ(file.mesh.blocks[2].type, ElementType::pyramid);
  EXPECT_EQ(file.mesh.blocks[3].type, ElementType::tetrahedron);
  ASSERT_EQ(file.held_cells().size(), 1U);
  EXPECT_EQ(file.held_cells()[0].name, "polyhedron");
  EXPECT_EQ(file.held_cells()[0].count, 1) << "seven faces";
  EXPECT_EQ(file.lower_dimensional_cell_count(), 19) << "the faces of patches";
}

// Old versions list the neighbours of all faces, with -1 for those of the boundary.
TEST_F(Foam, TakesAListOfNeighboursThatEndsInNone) {
  const MeshFile expected = read_mesh_file(case_);
  std::string text = bytes_of(mesh_file("neighbour"));
  const std::string four = "4(1 2 4 3)";
  text.replace(text.find(four), four.size(), "6(1 2 4 3 -1 -1)");
  put_bytes(mesh_file("neighbour"), text);

  const MeshFile file = read_mesh_file(case_);

  test::expect_same_connectivity(file.mesh, expected.mesh);
}

/// Seen along the element's ideal axis: all corners of valid elements turn the same way.
TEST_F(Foam, TurnsEveryElementOutward) {
  const MeshFile file = read_mesh_file(case_);
  const auto& nodes = std::get<std::vector<Vec3d>>(file.mesh.positions);
  for (const ElementBlock& block : file.mesh.blocks) {
    const ElementShape& shape = element_shape(block.type);
    for (int index = 0; index < shape.corner_count; ++index) {
      const CornerShape& corner = shape.corners[static_cast<std::size_t>(index)];
      const auto at = [&](std::int8_t local) {
        return nodes[static_cast<std::size_t>(block.nodes[static_cast<std::size_t>(local)])];
      };
      const Vec3d a = at(corner.neighbours[0]) - at(corner.node);
      const Vec3d b = at(corner.neighbours[1]) - at(corner.node);
      const Vec3d c = at(corner.neighbours[2]) - at(corner.node);
      EXPECT_GT(dot(cross(a, b), c), 0) << shape.name << ", corner " << index;
    }
  }
}

TEST_F(Foam, HoldsPolyhedraAndCoupledPatches) {
  const MeshFile file = read_mesh_file(case_);

  ASSERT_EQ(file.mesh.fixed.size(), 16U);
  std::vector<int> fixed;
  for (int node = 0; node < 16; ++node) {
    if (file.mesh.fixed[static_cast<std::size_t>(node)] != 0) fixed.push_back(node);
  }
  EXPECT_THAT(fixed, ElementsAre(0, 3, 4, 7, 12, 13, 14, 15)) << "of the polyhedron";
  for (const char* type : {"empty", "wedge", "processor", "processorCyclic"}) {
    replace("boundary", "wall;", std::string(type) + ";");
    EXPECT_THAT(read_mesh_file(case_).mesh.fixed[1], 1) << type;
    replace("boundary", std::string(type) + ";", "wall;");
  }
}

/// Of one face each.
std::string two_patches(const std::string& type, int first, int second) {
  const auto patch = [&](const std::string& name, int face, const std::string& neighbour) {
    return name + " { type " + type + "; neighbourPatch " + neighbour + "; nFaces 1; startFace " +
           std::to_string(face) + "; }\n";
  };
  return "FoamFile { format ascii; }\n2\n(\n" + patch("front", first, "back") +
         patch("back", second, "front") + ")\n";
}

TEST_F(Foam, NodesOfCyclicPatchesArePairs) {
  using Pairs = std::set<std::set<std::int64_t>>;
  for (const std::string type : {"cyclic", "cyclicAMI", "cyclicACMI", "cyclicSlip"}) {
    put_bytes(mesh_file("boundary"), two_patches(type, 9, 10));
    const MeshFile file = read_mesh_file(case_);
    EXPECT_EQ(pairs_of(file), (Pairs{{1, 2}, {5, 6}, {9, 10}})) << type;
    EXPECT_THAT(file.notes(), ::testing::IsEmpty());

    put_bytes(mesh_file("boundary"), two_patches(type, 9, 12));
    const MeshFile unlike = read_mesh_file(case_);
    EXPECT_EQ(pairs_of(unlike), (Pairs{{1}, {4}, {5}, {8}, {9}})) << type;
    ASSERT_EQ(unlike.notes().size(), 1U);
    EXPECT_THAT(unlike.notes().front(),
                AllOf(HasSubstr("patch \"front\" (" + type + ")"),
                      HasSubstr("takes \"front\" to \"back\""), HasSubstr("all of them stay")));
  }
}

TEST_F(Foam, HalvesOfAnOldCyclicPatchArePairs) {
  put_bytes(mesh_file("boundary"),
            "FoamFile { format ascii; }\n1\n(\nends { type cyclic; nFaces 2; startFace 9; }\n)\n");
  EXPECT_EQ(pairs_of(read_mesh_file(case_)),
            (std::set<std::set<std::int64_t>>{{1, 2}, {5, 6}, {9, 10}}));
}

TEST_F(Foam, NamesPatchesAndZones) {
  const MeshFile file = read_mesh_file(case_);

  EXPECT_THAT(find_node_set(file, "floor"), ElementsAre(0, 1, 2, 3, 9, 10, 12, 13));
  EXPECT_THAT(find_node_set(file, "ring"), ElementsAre(5, 6, 8, 11));
  EXPECT_THAT(find_node_set(file, "inner"), ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(find_node_set(file, "high"), ElementsAre(4, 5, 6, 7, 8, 11));
  const Regions regions = find_regions(file);
  EXPECT_EQ(regions.array, "foam:cell_zone");
  EXPECT_THAT(regions.of_element, ElementsAre(0, 0, 1, 1));
}

TEST_F(Foam, NamesGroupsOfPatches) {
  replace("boundary", "type            patch;", "type patch; inGroups 2(heated floor);");
  for (const std::string way : {"2(wall heated)", "List<word> 2(wall heated)", "(wall heated)"}) {
    replace("boundary", "1(wall)", way);
    const MeshFile file = read_mesh_file(case_);
    const std::vector<NodeId> floor = find_node_set(file, "floor");
    const std::vector<NodeId> sides = find_node_set(file, "sides");
    std::vector<NodeId> both;
    std::ranges::set_union(floor, sides, std::back_inserter(both));
    EXPECT_EQ(find_node_set(file, "heated"), both) << way;
    EXPECT_EQ(find_node_set(file, "wall"), floor) << way;
    EXPECT_THAT(floor, ElementsAre(0, 1, 2, 3, 9, 10, 12, 13)) << "the patch, not the group";
    replace("boundary", way, "1(wall)");
  }
}

TEST_F(Foam, PassesOverADictionaryInAHeader) {
  replace("faces", "format      ascii;",
          "meta { names (a b); note { by \"x\"; } }\nformat binary;");
  EXPECT_EQ(error().first, "FORMAT_ERROR") << "the entry after it counts";
  replace("faces", "format binary;", "format ascii;");
  EXPECT_EQ(read_mesh_file(case_).mesh.element_count(), 4U);
}

TEST_F(Foam, IsNamedByCaseFolderMeshFolderOrFile) {
  put_bytes(case_ / "case.foam", "");
  const MeshFile expected = read_mesh_file(case_);
  for (const path& name : {case_ / "constant" / "polyMesh", case_ / "case.foam", case_ / ""}) {
    EXPECT_TRUE(read_mesh_file(name).mesh.positions == expected.mesh.positions) << name;
  }
  EXPECT_EQ(error_of([&] { static_cast<void>(read_mesh_file(case_ / "constant")); }).first,
            "FILE_NOT_READABLE");
}

TEST_F(Foam, WritesNothingButThePointsInPlace) {
  const std::string before = bytes_of(mesh_file("points"));
  MeshFile file = read_mesh_file(case_);
  write_mesh_file(case_, file);
  EXPECT_EQ(bytes_of(mesh_file("points")), before);

  positions_of(file)[1].x = 1.0 / 3;
  positions_of(file)[15].z = -0.0;
  positions_of(file)[8] = {0.5, 0.25, 2};
  write_mesh_file(case_, file);

  EXPECT_THAT(changed_lines(before, bytes_of(mesh_file("points"))),
              ElementsAre("(0.3333333333333333 0 0)", "(0.5 0.25 2)", "(-1 0 -0)"));
  EXPECT_TRUE(read_mesh_file(case_).mesh.positions == file.mesh.positions);
  for (const auto& entry : std::filesystem::directory_iterator(mesh_file("").parent_path())) {
    const path name = entry.path().filename();
    EXPECT_TRUE(std::filesystem::exists(fixture("foam/constant/polyMesh") / name)) << name;
    if (name != "points") {
      EXPECT_EQ(bytes_of(entry.path()), bytes_of(fixture("foam/constant/polyMesh") / name));
    }
  }
}

TEST_F(Foam, WritesACaseElsewhere) {
  MeshFile file = read_mesh_file(case_);
  positions_of(file)[1].x = 0.875;
  std::filesystem::create_directories(scratch_.path("there/system"));
  for (const path& target : {scratch_.path("there"), scratch_.path("new/"),
                             scratch_.path("a/constant/polyMesh"), scratch_.path("b/b.foam")}) {
    EXPECT_EQ(error_of([&] { check_writable(target, case_); }).second, "no error") << target;
    write_mesh_file(target, file);
    const MeshFile after = read_mesh_file(target);
    EXPECT_TRUE(after.mesh.positions == file.mesh.positions) << target;
    EXPECT_EQ(find_node_set(after, "high"), find_node_set(file, "high"));
  }
  EXPECT_TRUE(std::filesystem::exists(scratch_.path("b/b.foam")));
  EXPECT_EQ(bytes_of(mesh_file("points")), bytes_of(fixture("foam/constant/polyMesh/points")));
}

#if defined(MESHSMOOTH_WITH_VTK)
TEST_F(Foam, BecomesAVtkFileUnlessThereArePolyhedra) {
  const auto [reason, text] =
      error_of([&] { write_mesh_file(scratch_.path("a.vtu"), read_mesh_file(case_)); });
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("\".vtu\" files cannot carry the 1 polyhedra of the mesh"));
}
#endif

TEST_F(Foam, IsWrittenFromOpenFoamOnly) {
  const auto [reason, text] =
      error_of([&] { write_mesh_file(case_, read_mesh_file(fixture("tetgen.node"))); });
  EXPECT_EQ(reason, "FORMAT_UNKNOWN");
  EXPECT_THAT(
      text, HasSubstr("\".foam\" files are written only with the contents of a file of the same"));
  EXPECT_EQ(error_of([&] { write_mesh_file(scratch_.path("a.obj"), read_mesh_file(case_)); }).first,
            "ELEMENT_NOT_SUPPORTED");
}

// --- binary -------------------------------------------------------------------------

struct Binary {
  int label;
  int scalar;
  bool swapped;
};

class FoamBinary : public Foam, public ::testing::WithParamInterface<Binary> {
 protected:
  template <class Number>
  static void append(std::string& text, Number number) {
    std::string bytes(sizeof number, '\0');
    std::memcpy(bytes.data(), &number, sizeof number);
    if (GetParam().swapped) std::ranges::reverse(bytes);
    text += bytes;
  }
  static std::string list(const std::vector<std::int64_t>& labels) {
    std::string text = std::to_string(labels.size()) + "\n";
    if (labels.empty()) return text;
    text += "(";
    for (const std::int64_t label : labels) {
      GetParam().label == 64 ? append(text, label) : append(text, static_cast<std::int32_t>(label));
    }
    return text + ")\n";
  }
  void put(const std::string& name, const std::string& type, const std::string& body) const {
    put_bytes(mesh_file(name), "/* bytes */ FoamFile\n{\n format binary;\n class " + type +
                                   ";\n arch \"" + (GetParam().swapped ? "MSB" : "LSB") +
                                   ";label=" + std::to_string(GetParam().label) + ";scalar=" +
                                   std::to_string(GetParam().scalar) + "\";\n}\n" + body);
  }
  /// The same mesh in bytes.
  void convert() const {
    FoamReader points(mesh_file("points"));
    const CoordinateFields fields = points.points();
    std::string bytes = std::to_string(fields.positions.size()) + "\n(";
    for (const Vec3d& position : fields.positions) {
      for (const double value : {position.x, position.y, position.z}) {
        GetParam().scalar == 64 ? append(bytes, value) : append(bytes, static_cast<float>(value));
      }
    }
    put("points", "vectorField", bytes + ")\n");
    const FoamFaces faces = FoamReader(mesh_file("faces")).faces();
    put("faces", "faceCompactList", list(faces.first) + list(faces.nodes));
    for (const char* name : {"owner", "neighbour"}) {
      put(name, "labelList", list(FoamReader(mesh_file(name)).labels()));
    }
    put("cellZones", "regIOobject",
        "2\n(\nlow\n{\n type cellZone;\ncellLabels List<label> \n" + list({0, 1}) +
            ";\n}\nhigh\n{\n type cellZone;\ncellLabels List<label> " + list({2, 3}) + ";\n}\n)\n");
    put("faceZones", "regIOobject",
        "1\n(\ninner\n{\n type faceZone;\nfaceLabels List<label> \n" + list({0}) +
            ";\nflipMap List<bool> \n1\n(\x01)\n;\n}\n)\n");
  }
};
INSTANTIATE_TEST_SUITE_P(Widths, FoamBinary,
                         ::testing::Values(Binary{32, 64, false}, Binary{64, 64, false},
                                           Binary{32, 32, false}, Binary{64, 32, true},
                                           Binary{32, 64, true}),
                         [](const auto& param) {
                           return "Label" + std::to_string(param.param.label) + "Scalar" +
                                  std::to_string(param.param.scalar) +
                                  (param.param.swapped ? "Swapped" : "");
                         });

TEST_P(FoamBinary, IsReadAndWrittenAsText) {
  const MeshFile expected = read_mesh_file(case_);
  convert();
  const std::string before = bytes_of(mesh_file("points"));

  MeshFile file = read_mesh_file(case_);

  test::expect_same_connectivity(file.mesh, expected.mesh);
  EXPECT_EQ(find_node_set(file, "inner"), find_node_set(expected, "inner"));
  EXPECT_EQ(find_regions(file).of_element, find_regions(expected).of_element);
  EXPECT_EQ(std::holds_alternative<std::vector<Vec3f>>(file.mesh.positions),
            GetParam().scalar == 32);
  write_mesh_file(case_, file);
  EXPECT_EQ(bytes_of(mesh_file("points")), before);
  test::move_nodes(file.mesh);
  write_mesh_file(case_, file);
  EXPECT_EQ(bytes_of(mesh_file("points")).size(), before.size());
  EXPECT_TRUE(read_mesh_file(case_).mesh.positions == file.mesh.positions);
}

TEST_P(FoamBinary, SaysWhenBytesAreMissing) {
  convert();
  for (const char* name : {"points", "faces", "owner", "neighbour", "cellZones"}) {
    const std::string bytes = bytes_of(mesh_file(name));
    put_bytes(mesh_file(name), bytes.substr(0, bytes.size() - 9));
    const auto [reason, text] = error();
    EXPECT_TRUE(reason == "FILE_TRUNCATED" || reason == "FORMAT_ERROR") << name << ": " << reason;
    EXPECT_THAT(text, HasSubstr(mesh_file(name).string() + ": "));
    put_bytes(mesh_file(name), bytes);
  }
}

// --- what is wrong with a case ------------------------------------------------------

TEST_F(Foam, SaysWhatIsWrongWithACaseAndWhere) {
  const struct {
    std::string file;
    std::string from;
    std::string to;
    std::string reason;
    std::string what;
  } changes[] = {
      {"points", "FoamFile", "Foam", "FORMAT_ERROR", "line 1: expected FoamFile, found \"Foam\""},
      {"points", "ascii", "other", "FORMAT_ERROR", "line 4: expected ascii or binary"},
      {"points", "(1 1 0)", "(1 1)", "FORMAT_ERROR", "line 16: expected ), found \"(\""},
      {"points", "(1 1 0)", "(1 x 0)", "FORMAT_ERROR", "line 15: expected a number, found \"x\""},
      {"points", "16\n", "17\n", "FORMAT_ERROR", "expected (, found \")\""},
      {"points", "16\n", "16000\n", "FILE_TRUNCATED", "too short for the 16000 things"},
      {"points", ")\n\n// ***\n", "", "FILE_TRUNCATED", "ends too early"},
      {"faces", "3(5 6 8)", "3(5 6 16)", "FORMAT_ERROR", "face 3 uses node 16, there are only 16"},
      {"faces", "3(5 6 8)", "3(5 6 -1)", "FORMAT_ERROR", "face 3 uses node -1"},
      {"faces", "3(5 6 8)", "2(5 6)", "FORMAT_ERROR", "face 3 has fewer than three nodes"},
      {"faces", "3(5 6 8)", "4(5 6 8)", "FORMAT_ERROR", "expected a number, found \")\""},
      {"faces", "23\n", "22\n", "FORMAT_ERROR", "expected ), found \"3\""},
      {"owner", "23\n(\n0\n", "22\n(\n", "FORMAT_ERROR", "22 owners of 23 faces"},
      {"owner", "(\n0", "(\n-1", "FORMAT_ERROR", "face 0 belongs to cell -1"},
      {"owner", "(\n0", "(\n23", "FORMAT_ERROR", "face 0 belongs to cell 23"},
      {"owner", "(\n0", "(\n6", "FORMAT_ERROR", "cell 5 has no faces"},
      {"neighbour", "4(1 2 4 3)", "24{0}", "FORMAT_ERROR", "24 neighbours of 23 faces"},
      {"neighbour", "4(1 2 4 3)", "4(1 2 4 x)", "FORMAT_ERROR", "expected a number, found \"x\""},
      {"boundary", "startFace       20", "startFace       21", "FORMAT_ERROR",
       "patch \"ring\": its 3 faces from 21 are not among the faces 4 to 22"},
      {"boundary", "startFace       4", "startFace       3", "FORMAT_ERROR", "patch \"floor\""},
      {"boundary", "nFaces          3", "nFaces          -3", "FORMAT_ERROR", "patch \"floor\""},
      {"boundary", "nFaces          3", "nFaces          9223372036854775807", "FORMAT_ERROR",
       "patch \"floor\""},
      {"boundary", "1(wall);", "1(wall;", "FORMAT_ERROR", "expected )"},
      {"cellZones", "2(0 1)", "2(0 5)", "FORMAT_ERROR", "zone \"low\" has 5, there are only 5"},
  };
  for (const auto& [file, from, to, reason, what] : changes) {
    replace(file, from, to);
    const auto [found, message] = error();
    EXPECT_EQ(found, reason) << from << " -> " << to;
    EXPECT_THAT(message, HasSubstr(what)) << from << " -> " << to;
    EXPECT_THAT(message, HasSubstr(mesh_file(file).string() + ": "));
    put_bytes(mesh_file(file), bytes_of(fixture("foam/constant/polyMesh") / file));
  }
}

TEST_F(Foam, NeedsAllItsFiles) {
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary"}) {
    std::filesystem::rename(mesh_file(name), mesh_file("away"));
    EXPECT_EQ(error().first, "FILE_NOT_FOUND") << name;
    put_bytes(mesh_file(std::string(name) + ".gz"), "x");
    EXPECT_THAT(error().second, HasSubstr(mesh_file(std::string(name) + ".gz: ").string()));
    std::filesystem::remove(mesh_file(std::string(name) + ".gz"));
    std::filesystem::rename(mesh_file("away"), mesh_file(name));
  }
}

TEST_F(Foam, KnowsWhereItCannotWrite) {
  put_bytes(scratch_.path("file"), "");
  EXPECT_EQ(error_of([&] {
              check_writable(scratch_.path("file") / "constant" / "polyMesh", case_);
            }).first,
            "FILE_NOT_WRITABLE");
  EXPECT_EQ(error_of([&] { check_writable(scratch_.path("no_case")); }).first, "FORMAT_UNKNOWN");
  EXPECT_EQ(error_of([&] { check_writable(scratch_.path("no_case/"), case_); }).first, "");
  EXPECT_EQ(error_of([&] { check_writable(scratch_.path("file").parent_path()); }).first,
            "FORMAT_UNKNOWN")
      << "a folder that is no case";
}

// A mesh of one cell has a uniform list of owners and an empty one of neighbours.
TEST_F(Foam, ReadsOneCell) {
  const std::string header = "FoamFile { format ascii; class x; }\n";
  put_bytes(mesh_file("points"), header + "4((0 0 0)(1 0 0)(0 1 0)(0 0 1))");
  put_bytes(mesh_file("faces"), header + "4(3(0 2 1) 3(0 1 3) 3(1 2 3) 3(2 0 3))");
  put_bytes(mesh_file("owner"), header + "4{0}");
  put_bytes(mesh_file("neighbour"), header + "0()");
  put_bytes(mesh_file("boundary"), header + "1(all{type patch;startFace 0;nFaces 4;})");
  std::filesystem::remove(mesh_file("cellZones"));
  std::filesystem::remove(mesh_file("faceZones"));

  const MeshFile file = read_mesh_file(case_);
  EXPECT_THAT(file.mesh.blocks.at(0).nodes, ElementsAre(1, 2, 0, 3));
}

}  // namespace
}  // namespace meshsmooth::formats

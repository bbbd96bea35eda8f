// *SURFACE in decks of Abaqus and CalculiX.

#include <gmock/gmock.h>

#include "content.hpp"
#include "inner_cells.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::ids_of_set;
using test::put_bytes;
using test::Scratch;
using Ids = std::vector<std::int64_t>;

class AbaqusSurfaces : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.inp"), text);
    return read_mesh_file(scratch_.path("in.inp"));
  }

  const Scratch scratch_;
};

/// Eight hexahedra; the nodes 1 to 27, first along x, then y, then z.
std::string eight_cubes() {
  std::string text = "*NODE\n";
  int label = 0;
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 3; ++x) {
        text += std::to_string(++label) + ", " + std::to_string(x) + ", " + std::to_string(y) +
                ", " + std::to_string(z) + "\n";
      }
    }
  }
  text += "*ELEMENT, TYPE=C3D8\n";
  int element = 0;
  for (const int z : {0, 9}) {
    for (const int y : {0, 3}) {
      for (const int x : {1, 2}) {
        text += std::to_string(++element);
        for (const int corner : {0, 1, 4, 3, 9, 10, 13, 12}) {
          text += ", " + std::to_string(x + y + z + corner);
        }
        text += "\n";
      }
    }
  }
  return text;
}

TEST_F(AbaqusSurfaces, InsideTheMeshAreInnerCells) {
  const Ids middle = {2, 5, 8, 11, 14, 17, 20, 23, 26};  // x = 1
  for (const std::string way :
       {"*SURFACE, NAME=fault, TYPE=ELEMENT\n1, S4\n3, S4\n5, S4\n7, S4\n",
        "*ELSET, ELSET=left, GENERATE\n1, 7, 2\n*Surface, name=fault\nleft, s4\n",
        "*ELSET, ELSET=right\n2, 4, 6, 8\n*SURFACE, TYPE=ELEMENT, NAME=fault\n right , S6 ,\n"}) {
    const MeshFile file = read(eight_cubes() + way);
    EXPECT_EQ(ids_of_set(file, "fault"), middle) << way;
    const InnerCells inner = find_inner_cells(file);
    EXPECT_EQ(inner.nodes.size(), 9U) << way;
    EXPECT_THAT(inner.names, ::testing::ElementsAre("fault"));
  }
}

TEST_F(AbaqusSurfaces, OnTheBoundaryHoldNothing) {
  const MeshFile file = read(eight_cubes() + "*SURFACE, NAME=foot\n1, S1\n2, S1\n");
  EXPECT_EQ(ids_of_set(file, "foot"), (Ids{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(find_inner_cells(file).nodes.empty());
}

TEST_F(AbaqusSurfaces, OfEveryTypeHaveTheNodesOfTheirFaces) {
  struct Solid {
    std::string type;
    int node_count;
    std::vector<Ids> faces;
  };
  const std::vector<Solid> solids = {
      {"C3D4", 4, {{1, 2, 3}, {1, 2, 4}, {2, 3, 4}, {1, 3, 4}}},
      {"C3D10",
       10,
       {{1, 2, 3, 5, 6, 7}, {1, 2, 4, 5, 8, 9}, {2, 3, 4, 6, 9, 10}, {1, 3, 4, 7, 8, 10}}},
      {"C3D5", 5, {{1, 2, 3, 4}, {1, 2, 5}, {2, 3, 5}, {3, 4, 5}, {1, 4, 5}}},
      {"C3D6", 6, {{1, 2, 3}, {4, 5, 6}, {1, 2, 4, 5}, {2, 3, 5, 6}, {1, 3, 4, 6}}},
      {"C3D15", 15, {{1, 2, 3, 7, 8, 9}, {4, 5, 6, 10, 11, 12}, {1, 2, 4, 5, 7, 10, 13, 14}}},
      {"C3D20",
       20,
       {{1, 2, 3, 4, 9, 10, 11, 12}, {5, 6, 7, 8, 13, 14, 15, 16}, {1, 2, 5, 6, 9, 13, 17, 18}}}};
  for (const Solid& solid : solids) {
    std::string text = "*NODE\n", element = "1";
    for (int node = 1; node <= solid.node_count; ++node) {
      const std::string label = std::to_string(node);
      text += label + ", " + std::to_string(node * node) + ", " + label + ", 1\n";
      element += ", " + label;
    }
    text += "*ELEMENT, TYPE=" + solid.type + "\n" + element + "\n";
    for (std::size_t face = 0; face < solid.faces.size(); ++face) {
      const std::string number = std::to_string(face + 1);
      const MeshFile file = read(text + "*SURFACE, NAME=s\n1, S" + number + "\n");
      EXPECT_EQ(ids_of_set(file, "s"), solid.faces[face]) << solid.type << " S" << number;
    }
  }
}

/// Of a shell the sides S1 and S2 are its faces in CalculiX, the next ones its edges.
TEST_F(AbaqusSurfaces, OfSurfaceElementsHaveTheNodesOfTheirEdges) {
  struct Case {
    std::string type;
    int node_count;
    std::string side;
    Ids nodes;
  };
  const std::vector<Case> cases = {
      {"CPS3", 3, "S1", {1, 2}},    {"CPE3", 3, "S3", {1, 3}},    {"CAX4R", 4, "S2", {2, 3}},
      {"CPS4", 4, "S4", {1, 4}},    {"CPE6", 6, "S2", {2, 3, 5}}, {"CPS8R", 8, "S4", {1, 4, 8}},
      {"S3", 3, "E2", {2, 3}},      {"S4R", 4, "E4", {1, 4}},     {"S4", 4, "S3", {1, 2}},
      {"S6", 6, "S5", {1, 3, 6}},   {"S8R", 8, "E1", {1, 2, 5}},  {"M3D4", 4, "S6", {1, 4}},
      {"S8R5", 8, "e3", {3, 4, 7}}, {"S4", 4, "S1", {}},          {"S4", 4, "SPOS", {}},
      {"S3", 3, "E4", {}},          {"CPS3", 3, "S4", {}},        {"CPS4", 4, "E1", {}}};
  for (const auto& [type, node_count, side, nodes] : cases) {
    std::string text = "*NODE\n", element = "1";
    for (int node = 1; node <= node_count; ++node) {
      const std::string label = std::to_string(node);
      text += label + ", " + std::to_string(node * node) + ", " + label + "\n";
      element += ", " + label;
    }
    text += "*ELEMENT, TYPE=" + type + "\n" + element + "\n*SURFACE, NAME=s\n1, " + side + "\n";
    const MeshFile file = read(text);
    if (nodes.empty()) {
      EXPECT_TRUE(node_set_names(file).empty()) << type << " " << side;
    } else {
      EXPECT_EQ(ids_of_set(file, "s"), nodes) << type << " " << side;
    }
  }
}

TEST_F(AbaqusSurfaces, OtherFormsAreNoneOfOurs) {
  const std::string set = "*ELSET, ELSET=all\n1, 2\n";
  for (const std::string way :
       {"*SURFACE, NAME=s, TYPE=NODE\n1\n2, 0.5\n", "*SURFACE, NAME=s\nall,\n",
        "*SURFACE, NAME=s\nall, SPOS\n", "*SURFACE, NAME=s\n1, S9\n, S1\n\n", "*SURFACE\n1, S1\n",
        "*SURFACE, NAME=s, TYPE=CYLINDERS\n0, 0, 0, 1, 0, 0\n"}) {
    EXPECT_THAT(read(eight_cubes() + set + way).notes(), ::testing::IsEmpty()) << way;
  }
  const MeshFile file = read(eight_cubes() + "*SURFACE, NAME=s\nnobody, S1\n1, S1\n99, S1\n");
  EXPECT_EQ(ids_of_set(file, "s"), (Ids{1, 2, 4, 5}));
  EXPECT_EQ(file.notes().size(), 2U);
}

}  // namespace
}  // namespace meshsmooth::formats

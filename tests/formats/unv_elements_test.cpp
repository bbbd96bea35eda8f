// Elements and groups of universal files.

#include <gmock/gmock.h>

#include "content.hpp"
#include "mesh_file.hpp"
#include "named_sets.hpp"
#include "second_order.hpp"
#include "unv_text.hpp"

namespace meshsmooth::formats {
namespace {

using namespace test::unv;
using test::bytes_of;
using test::changed_lines;
using test::error_of;
using test::fixture;
using test::ids_of_set;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class UnvElements : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text) const {
    put_bytes(scratch_.path("in.unv"), text);
    return read_mesh_file(scratch_.path("in.unv"));
  }
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& text) const {
    return error_of([&] { static_cast<void>(read(text)); });
  }
  [[nodiscard]] std::string written(const MeshFile& file) const {
    write_mesh_file(scratch_.path("out.unv"), file);
    return bytes_of(scratch_.path("out.unv"));
  }

  const Scratch scratch_;
};

// --- elements ------------------------------------------------------------------

struct Shape {
  int descriptor;
  const char* kind;
  std::vector<Vec3d> corners;
  const char* order;  // all nodes in the file's order, by their corners from 1
};

const std::vector<Vec3d> kTriangle = {{0, 0, 0}, {1, 0.1, 0}, {0, 1.1, 0}};
const std::vector<Vec3d> kQuad = {{0, 0, 0}, {1, 0.1, 0}, {1.2, 1.3, 0}, {0, 1.1, 0}};
const std::vector<Vec3d> kTetrahedron = {{0, 0, 0}, {1, 0.1, 0}, {0, 1.1, 0}, {0.2, 0, 1.3}};
const std::vector<Vec3d> kWedge = {{0, 0, 0},     {1, 0.1, 0},   {0, 1.1, 0},
                                   {0.2, 0, 1.3}, {1.1, 0, 1.4}, {0.1, 1.4, 1}};
const std::vector<Vec3d> kHexahedron = {{0, 0, 0},   {1, 0.1, 0},   {1.2, 1.3, 0},   {0, 1.1, 0},
                                        {0, 0, 1.2}, {1, 0.1, 1.1}, {1.2, 1.3, 1.4}, {0, 1.1, 1}};

std::vector<Shape> shapes() {
  std::vector<Shape> all;
  for (const int family : {40, 50, 60, 80, 90}) {
    all.push_back({family + 1, "triangle", kTriangle, "1 2 3"});
    all.push_back({family + 2, "triangle6", kTriangle, "1 12 2 23 3 31"});
    all.push_back({family + 4, "quad", kQuad, "1 2 3 4"});
    all.push_back({family + 5, "quad8", kQuad, "1 12 2 23 3 34 4 41"});
  }
  for (const int descriptor : {71, 74}) {  // either may be the triangle
    all.push_back({descriptor, "triangle", kTriangle, "1 2 3"});
    all.push_back({descriptor, "quad", kQuad, "1 2 3 4"});
  }
  const char* const wedge15 = "1 12 2 23 3 31 14 25 36 4 45 5 56 6 64";
  const char* const brick20 = "1 12 2 23 3 34 4 41 15 26 37 48 5 56 6 67 7 78 8 85";
  all.push_back({111, "tetrahedron", kTetrahedron, "1 2 3 4"});
  all.push_back({118, "tetrahedron10", kTetrahedron, "1 12 2 23 3 31 14 24 34 4"});
  for (const int descriptor : {101, 112}) {
    all.push_back({descriptor, "wedge", kWedge, "1 2 3 4 5 6"});
    all.push_back({descriptor + 1, "wedge15", kWedge, wedge15});
  }
  for (const int descriptor : {104, 115}) {
    all.push_back({descriptor, "hexahedron", kHexahedron, "1 2 3 4 5 6 7 8"});
    all.push_back({descriptor + 1, "hexahedron20", kHexahedron, brick20});
  }
  return all;
}

TEST_F(UnvElements, ReadsEveryElementInTheOrderOfVtk) {
  for (const Shape& shape : shapes()) {
    std::vector<Node> nodes;
    std::vector<std::int64_t> labels;
    std::istringstream order(shape.order);
    for (std::string part; order >> part;) {
      Vec3d sum{0, 0, 0};
      for (const char corner : part) sum += shape.corners[static_cast<std::size_t>(corner - '1')];
      labels.push_back(100 + static_cast<std::int64_t>(nodes.size()));
      nodes.push_back({labels.back(), (1.0 / static_cast<double>(part.size())) * sum});
    }
    const MeshFile file =
        read(nodes_2411(nodes) + data_set("2412", element(9, shape.descriptor, labels)));

    const std::map<std::string, int> one = {{shape.kind, 1}};
    EXPECT_EQ(test::check_cells(file), one) << shape.descriptor;
    EXPECT_EQ(measure_quality(file.mesh).inverted_count, 0) << shape.descriptor;
  }
}

TEST_F(UnvElements, TakesRodsBeamsSpringsAndMassesForLowerDimensionalCells) {
  const MeshFile file =
      read(nodes_2411(kSquare) +
           data_set("2412", kTriangles + element(5, 11, {10, 20}) + element(6, 21, {20, 30}) +
                                element(7, 24, {30, 50, 40}) + element(8, 136, {10, 50}) +
                                element(9, 161, {50}) + element(10, 121, {10, 30}) +
                                integers({11, 24, 1, 1, 7, 3}) + integers({30, 50, 40}) +
                                integers({12, 31, 1, 1, 7, 2}) + integers({30, 40})));

  EXPECT_EQ(file.lower_dimensional_cell_count(), 8);
  EXPECT_THAT(file.held_cells(), IsEmpty());
  Cell cell;
  for (const std::int64_t id : {6, 10}) {
    file.content()->dataset->get_cell(id, cell);
    EXPECT_EQ(cell.type, kEdge3Cell);
    EXPECT_THAT(cell.nodes, ElementsAre(2, 3, 4)) << "corners first";
  }
}

TEST_F(UnvElements, HoldsTheNodesOfElementsThatItCannotSmooth) {
  const MeshFile file =
      read(nodes_2411(kSquare) +
           data_set("2412", kTriangles + element(5, 122, {10, 20, 30, 40}) +
                                element(6, 43, {10, 20, 30, 40, 50, 10, 20, 30, 40, 50}) +
                                element(7, 122, {10, 20, 30, 50})));

  ASSERT_THAT(file.held_cells(), SizeIs(2));
  EXPECT_EQ(file.held_cells()[0].name, "FE descriptor 122 with 4 nodes");
  EXPECT_EQ(file.held_cells()[0].count, 2);
  EXPECT_EQ(file.held_cells()[1].name, "FE descriptor 43 with 10 nodes");
  EXPECT_THAT(file.mesh.fixed, ElementsAre(1, 1, 1, 1, 1));
  EXPECT_EQ(file.mesh.element_count(), 4U);
}

// --- groups --------------------------------------------------------------------

TEST_F(UnvElements, HasGroupsOfNodesAndElementsAsSets) {
  const std::string pairs = integers({7, 20, 7, 30, 7, 99, 8, 1}) + integers({8, 4});
  const std::string quads = integers({7, 20, 0, 0, 7, 30, 0, 0}) +
                            integers({7, 99, 0, 0, 8, 1, 0, 0}) + integers({8, 4, 0, 0});
  for (const char* number : {"752", "2417", "2429", "2430", "2432"}) {
    const MeshFile file =
        read(kPlane + data_set(number, integers({3, 0, 0, 0, 0, 5}) + "inlet wall\n" + pairs));
    EXPECT_THAT(ids_of_set(file, "inlet wall"), ElementsAre(10, 20, 30, 40, 50)) << number;
  }
  for (const char* number : {"2435", "2452", "2467", "2477"}) {
    const MeshFile file = read(data_set(number, integers({3, 0, 0, 0, 0, 0, 0, 5}) + "wall\n" +
                                                    quads + integers({4, 0, 0, 0, 0, 0, 0, 1}) +
                                                    "\n" + integers({7, 10, 0, 0})) +
                               kPlane);
    EXPECT_THAT(ids_of_set(file, "wall"), ElementsAre(10, 20, 30, 40, 50)) << number;
    EXPECT_THAT(ids_of_set(file, "4"), ElementsAre(10)) << "it has no name";
    EXPECT_THAT(find_regions(file).of_element, ElementsAre(1, 0, 0, 1));
  }
}

// Gmsh's reader crashed on them.
TEST_F(UnvElements, ReadsGroupsOfSpringsMassesAndElementsThatAreNotThere) {
  const std::string elements =
      kTriangles + element(5, 136, {10, 50}) + element(6, 161, {50}) + element(7, 999, {30, 50});
  const MeshFile file = read(nodes_2411(kSquare) + data_set("2412", elements) +
                             data_set("2477", integers({1, 0, 0, 0, 0, 0, 0, 4}) + "GROUP\n" +
                                                  integers({8, 5, 0, 0, 8, 6, 0, 0}) +
                                                  integers({8, 7, 0, 0, 8, 77, 0, 0})));

  EXPECT_THAT(ids_of_set(file, "GROUP"), ElementsAre(10, 30, 50));
  EXPECT_EQ(file.lower_dimensional_cell_count(), 2);
  EXPECT_EQ(file.held_cells().front().count, 1);
}

TEST_F(UnvElements, TellsElementsOfDifferentSetsOfGroupsApart) {
  const auto group = [](int number, const std::string& name, std::vector<std::int64_t> elements) {
    std::string text =
        integers({number, 0, 0, 0, 0, 0, 0, static_cast<std::int64_t>(elements.size())});
    text += name + "\n";
    for (const std::int64_t id : elements) text += integers({8, id, 0, 0});
    return text;
  };
  const MeshFile file =
      read(kPlane + data_set("2467", group(1, "all", {1, 2, 3, 4}) + group(2, "left", {3, 4})));

  EXPECT_EQ(find_regions(file).array, "gmsh:physical");
  EXPECT_THAT(find_regions(file).of_element, ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(ids_of_set(file, "left"), ElementsAre(10, 30, 40, 50));
}

}  // namespace
}  // namespace meshsmooth::formats

// Gmsh's MSH format: its versions, encodings and sections. Counts and errors: msh_errors_test.cpp.

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>

#include "content.hpp"
#include "named_sets.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::changed_lines;
using test::ids_of_set;
using test::pairs_of;
using test::positions_of;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Two tetrahedra, 205 and 207, of the group "rock", and a triangle, 101, of "wall". Nodes have
// numbers with gaps, one is in no element.
constexpr const char* kListedNodes =
    "6\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 1 1 1\n99 5 5 5\n";
constexpr const char* kNames = "$PhysicalNames\n2\n2 7 \"wall\"\n3 9 \"rock\"\n$EndPhysicalNames\n";

std::string version_1() {
  return std::string("$NOD\n") + kListedNodes +
         "$ENDNOD\n$ELM\n3\n101 2 7 1 3 10 20 30\n205 4 9 1 4 10 20 30 40\n"
         "207 4 9 2 4 20 50 30 40\n$ENDELM\n";
}

std::string version_2(const std::string& version, const std::string& nodes = kListedNodes) {
  const std::string names =
      version == "2.0" ? "$PhysicalNames\n2\n7 \"wall\"\n9 \"rock\"\n$EndPhysicalNames\n" : kNames;
  return "$MeshFormat\n" + version + " 0 8\n$EndMeshFormat\n" + names + "$Nodes\n" + nodes +
         "$EndNodes\n$Elements\n3\n101 2 2 7 1 10 20 30\n205 4 2 9 1 10 20 30 40\n"
         "207 4 5 9 2 2 1 -3 20 50 30 40\n$EndElements\n";  // of two partitions
}

constexpr const char* kEntities40 =
    "$Entities\n1 0 1 2\n1 0 0 0 0 0 0 0\n1 0 0 0 1 1 0 1 7 0\n"
    "1 0 0 0 1 1 1 1 9 1 1\n2 0 0 0 1 1 1 1 -9 0\n$EndEntities\n";

std::string version_40() {
  return std::string("$MeshFormat\n4 0 8\n$EndMeshFormat\n") + kNames + kEntities40 +
         "$Nodes\n2 6\n1 2 1 3\n10 0 0 0 .1 .2\n20 1 0 0 .3 .4\n30 0 1 0 .5 .6\n"
         "1 3 1 3\n40 0 0 1\n50 1 1 1\n99 5 5 5\n$EndNodes\n"
         "$Elements\n3 3\n1 2 2 1\n101 10 20 30\n1 3 4 1\n205 10 20 30 40\n"
         "2 3 4 1\n207 20 50 30 40\n$EndElements\n";
}

std::string version_41() {
  return std::string("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n") + kNames +
         "$Entities\n1 0 1 2\n1 0 0 0 0\n1 0 0 0 1 1 0 1 7 0\n"
         "1 0 0 0 1 1 1 1 9 1 1\n2 0 0 0 1 1 1 1 -9 0\n$EndEntities\n"
         "$Nodes\n2 6 10 99\n2 1 1 3\n10\n20\n30\n0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n"
         "3 1 0 3\n40\n50\n99\n0 0 1\n1 1 1\n5 5 5\n$EndNodes\n"
         "$Elements\n3 3 101 207\n2 1 2 1\n101 10 20 30\n3 1 4 1\n205 10 20 30 40\n"
         "3 2 4 1\n207 20 50 30 40\n$EndElements\n";
}

/// Sections of binary files.
class Bytes {
 public:
  explicit Bytes(bool swapped, std::size_t size_bytes = 8)
      : swapped_(swapped), size_bytes_(size_bytes) {}

  Bytes& text(const std::string& text) {
    all_ += text;
    return *this;
  }
  Bytes& integers(std::initializer_list<std::int32_t> values) {
    for (const std::int32_t value : values) add(value);
    return *this;
  }
  Bytes& sizes(std::initializer_list<std::uint64_t> values) {
    for (const std::uint64_t value : values) {
      if (size_bytes_ == 4) {
        add(static_cast<std::uint32_t>(value));
      } else {
        add(value);
      }
    }
    return *this;
  }
  Bytes& reals(std::initializer_list<double> values) {
    for (const double value : values) add(value);
    return *this;
  }
  [[nodiscard]] const std::string& all() const { return all_; }

 private:
  template <class T>
  void add(T value) {
    std::string bytes(sizeof value, 0);
    std::memcpy(bytes.data(), &value, sizeof value);
    if (swapped_) std::ranges::reverse(bytes);
    all_ += bytes;
  }

  bool swapped_;
  std::size_t size_bytes_;
  std::string all_;
};

constexpr std::array<std::array<double, 3>, 6> kPlaces = {
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {5, 5, 5}}};
constexpr std::array<int, 6> kIds = {10, 20, 30, 40, 50, 99};

/// `end`: what stands before the ends of sections.
std::string binary_2(bool swapped, const std::string& end = "\n") {
  Bytes file(swapped);
  file.text("$MeshFormat\n2.2 1 8\n").integers({1}).text("\n$EndMeshFormat\n").text(kNames);
  file.text("$Nodes\n6\n");
  for (std::size_t node = 0; node < 6; ++node) {
    file.integers({kIds[node]}).reals({kPlaces[node][0], kPlaces[node][1], kPlaces[node][2]});
  }
  file.text(end + "$EndNodes\n$Elements\n3\n");
  file.integers({2, 1, 2, 101, 7, 1, 10, 20, 30});
  file.integers({4, 2, 2, 205, 9, 1, 10, 20, 30, 40, 207, 9, 2, 20, 50, 30, 40});
  return file.text(end + "$EndElements\n").all();
}

std::string binary_40(bool swapped) {
  Bytes file(swapped);
  file.text("$MeshFormat\n4.0 1 8\n").integers({1}).text("\n$EndMeshFormat\n").text(kNames);
  file.text("$Entities\n").sizes({1, 0, 1, 2});
  file.integers({1}).reals({0, 0, 0, 0, 0, 0}).sizes({0});
  file.integers({1}).reals({0, 0, 0, 1, 1, 0}).sizes({1}).integers({7}).sizes({0});
  file.integers({1}).reals({0, 0, 0, 1, 1, 1}).sizes({1}).integers({9});
  file.sizes({1}).integers({1});
  file.integers({2}).reals({0, 0, 0, 1, 1, 1}).sizes({1}).integers({-9}).sizes({0});
  file.text("\n$EndEntities\n$Nodes\n").sizes({1, 6}).integers({1, 2, 1}).sizes({6});
  for (std::size_t node = 0; node < 6; ++node) {
    file.integers({kIds[node]}).reals({kPlaces[node][0], kPlaces[node][1], kPlaces[node][2]});
    file.reals({.25, .75});
  }
  file.text("\n$EndNodes\n$Elements\n").sizes({3, 3});
  file.integers({1, 2, 2}).sizes({1}).integers({101, 10, 20, 30});
  file.integers({1, 3, 4}).sizes({1}).integers({205, 10, 20, 30, 40});
  file.integers({2, 3, 4}).sizes({1}).integers({207, 20, 50, 30, 40});
  return file.text("\n$EndElements\n").all();
}

std::string binary_41(bool swapped, std::size_t size_bytes) {
  Bytes file(swapped, size_bytes);
  file.text("$MeshFormat\n4.1 1 " + std::to_string(size_bytes) + "\n").integers({1});
  file.text("\n$EndMeshFormat\n").text(kNames).text("$Entities\n").sizes({1, 0, 1, 2});
  file.integers({1}).reals({0, 0, 0}).sizes({0});
  file.integers({1}).reals({0, 0, 0, 1, 1, 0}).sizes({1}).integers({7}).sizes({0});
  file.integers({1}).reals({0, 0, 0, 1, 1, 1}).sizes({1}).integers({9}).sizes({0});
  file.integers({2}).reals({0, 0, 0, 1, 1, 1}).sizes({1}).integers({-9}).sizes({0});
  file.text("\n$EndEntities\n$Nodes\n").sizes({1, 6, 10, 99}).integers({2, 1, 1}).sizes({6});
  for (const int id : kIds) file.sizes({static_cast<std::uint64_t>(id)});
  for (const auto& place : kPlaces) file.reals({place[0], place[1], place[2], .25, .75});
  file.text("\n$EndNodes\n$Elements\n").sizes({3, 3, 101, 207});
  file.integers({2, 1, 2}).sizes({1, 101, 10, 20, 30});
  file.integers({3, 1, 4}).sizes({1, 205, 10, 20, 30, 40});
  file.integers({3, 2, 4}).sizes({1, 207, 20, 50, 30, 40});
  return file.text("\n$EndElements\n").all();
}

class Msh : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& bytes) const {
    put_bytes(scratch_.path("in.msh"), bytes);
    return read_mesh_file(scratch_.path("in.msh"));
  }
  /// The file, written with one node moved.
  [[nodiscard]] std::string moved(const std::string& bytes, std::size_t node = 3) const {
    MeshFile file = read(bytes);
    positions_of(file)[node].z = 1.0625;
    write_mesh_file(scratch_.path("out.msh"), file);
    return bytes_of(scratch_.path("out.msh"));
  }
  void expect_two_tetrahedra(const MeshFile& file, bool named = true) const {
    ASSERT_EQ(file.mesh.blocks.size(), 1U);
    EXPECT_EQ(file.mesh.blocks[0].type, ElementType::tetrahedron);
    EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 3, 1, 4, 2, 3));
    ASSERT_EQ(file.mesh.node_count(), 6U);
    const auto& places = std::get<std::vector<Vec3d>>(file.mesh.positions);
    for (std::size_t node = 0; node < 6; ++node) {
      EXPECT_EQ(places[node].x, kPlaces[node][0]);
      EXPECT_EQ(places[node].y, kPlaces[node][1]);
      EXPECT_EQ(places[node].z, kPlaces[node][2]);
      EXPECT_EQ(file.file_node_id(static_cast<std::int64_t>(node)), kIds[node]);
    }
    EXPECT_EQ(file.file_element_id(0), 205);
    EXPECT_EQ(file.file_element_id(1), 207);
    EXPECT_EQ(file.lower_dimensional_cell_count(), 1);
    EXPECT_THAT(ids_of_set(file, named ? "wall" : "7"), ElementsAre(10, 20, 30));
    EXPECT_THAT(ids_of_set(file, named ? "rock" : "9"), ElementsAre(10, 20, 30, 40, 50));
    EXPECT_EQ(find_regions(file).array, "gmsh:physical");
    EXPECT_EQ(find_regions(file).count, 1U);
    EXPECT_THAT(find_regions(file, "gmsh:geometrical").of_element, ElementsAre(0, 1));
  }

  const Scratch scratch_;
};

TEST_F(Msh, EveryVersionTellsOfTheSameMesh) {
  {
    SCOPED_TRACE("1.0");
    expect_two_tetrahedra(read(version_1()), false);
  }
  for (const char* version : {"2", "2.0", "2.1", "2.2", "2.200000"}) {
    SCOPED_TRACE(version);
    expect_two_tetrahedra(read(version_2(version)), std::string(version) != "2");
  }
  SCOPED_TRACE("4");
  expect_two_tetrahedra(read(version_40()));
  expect_two_tetrahedra(read(version_41()));
}

TEST_F(Msh, TheLayoutOf41MayBeCalledVersion4) {
  std::string text = version_41();
  text.replace(text.find("4.1 0 8"), 3, "4");
  expect_two_tetrahedra(read(text));
}

TEST_F(Msh, BinaryFilesOfBothByteOrdersTellOfTheSameMesh) {
  for (const bool swapped : {false, true}) {
    SCOPED_TRACE(swapped);
    expect_two_tetrahedra(read(binary_2(swapped)));
    expect_two_tetrahedra(read(binary_40(swapped)));
    expect_two_tetrahedra(read(binary_41(swapped, 8)));
    expect_two_tetrahedra(read(binary_41(swapped, 4)));
  }
}

TEST_F(Msh, ABinarySectionNeedsNoLineEnd) { expect_two_tetrahedra(read(binary_2(false, ""))); }

TEST_F(Msh, OnlyTheBytesOfACoordinateChange) {
  for (const std::string& before : {version_1(), version_2("2.2"), version_40(), version_41()}) {
    EXPECT_EQ(changed_lines(before, moved(before)).size(), 1U) << before.substr(0, 20);
  }
  for (const bool swapped : {false, true}) {
    for (const std::string& before :
         {binary_2(swapped), binary_40(swapped), binary_41(swapped, 8)}) {
      const std::string after = moved(before);
      ASSERT_EQ(after.size(), before.size());
      std::size_t changed = 0;
      for (std::size_t at = 0; at < before.size(); ++at) changed += before[at] != after[at];
      EXPECT_EQ(changed, 1U);  // 1 and 1.0625 differ in one byte
      EXPECT_EQ(positions_of(*std::make_unique<MeshFile>(read(after)))[3].z, 1.0625);
    }
  }
}

TEST_F(Msh, SectionsComeInAnyOrderAndUnknownOnesStay) {
  const std::string comments = "$Comments\n$Nodes are below\n3\n$EndComments\n";
  expect_two_tetrahedra(read(comments + version_2("2.2")));
  std::string text = version_41();
  const auto cut = [&](const std::string& name) {
    const std::size_t begin = text.find("$" + name);
    const std::string end = "$End" + name + "\n";
    const std::size_t length = text.find(end) + end.size() - begin;
    const std::string section = text.substr(begin, length);
    text.erase(begin, length);
    return section;
  };
  const std::string elements = cut("Elements");
  const std::string nodes = cut("Nodes");
  const std::string names = cut("PhysicalNames");
  const std::string entities = cut("Entities");
  const std::string own = "$Own\n1 2 3\n$EndOwn\n";
  const std::string periodic = "$Periodic\n1\n0 1 1\n0\n1\n20 10\n$EndPeriodic\n";
  const std::string shuffled = comments + text + own + elements + "\n\n" + periodic + names +
                               "a line of no section\n" + nodes + comments + entities;
  expect_two_tetrahedra(read(shuffled));
  EXPECT_EQ(changed_lines(shuffled, moved(shuffled)), std::vector<std::string>{"0 0 1.0625"});
}

TEST_F(Msh, PeriodicNodesArePairs) {
  const std::string affine = " 1 0 0 2 0 1 0 0 0 0 1 0 0 0 0 1\n";
  const std::string old =
      "$Periodic\n2\n0 1 1\n1\n20 10\n2 1 1\nAffine" + affine + "2\n20 10\n50 40\n$EndPeriodic\n";
  const std::string present =
      "$Periodic\n2\n0 1 1\n0\n1\n20 10\n2 1 1\n16" + affine + "2\n20 10\n50 40\n$EndPeriodic\n";
  for (const std::string& text : {version_2("2.2") + old, version_40() + old,
                                  version_41() + present, binary_2(false) + old}) {
    const MeshFile file = read(text);
    EXPECT_EQ(pairs_of(file), (std::set<std::set<std::int64_t>>{{10, 20}, {40, 50}}))
        << text.substr(0, 20);
    EXPECT_EQ(file.node_pairs().size(), 2U);
    EXPECT_TRUE(file.mesh.fixed.empty());
  }
}

TEST_F(Msh, AByteOrderMarkAndWindowsLineEndsStay) {
  std::string text = "\xEF\xBB\xBF";
  for (const char letter : version_2("2.2"))
    text += letter == '\n' ? "\r\n" : std::string(1, letter);
  expect_two_tetrahedra(read(text));
  EXPECT_EQ(changed_lines(text, moved(text)), std::vector<std::string>{"40 0 0 1.0625\r"});
}

TEST_F(Msh, NodesWithParametersAreNodes) {
  std::string text =
      version_2("2.2",
                "6\n10 0 0 0 0 1\n20 1 0 0 1 3 .5\n30 0 1 0 2 1 .25 .75\n40 0 0 1 3 1\n"
                "50 1 1 1 3 1\n99 5 5 5 3 1\n");
  for (const char* name : {"$Nodes", "$EndNodes"}) {
    const std::string parametric = name == std::string("$Nodes") ? "$Parametric" : "$EndParametric";
    text.replace(text.find(name), std::string(name).size(), parametric + "Nodes");
  }
  expect_two_tetrahedra(read(text));
  EXPECT_EQ(changed_lines(text, moved(text, 2)),
            std::vector<std::string>{"30 0 1 1.0625 2 1 .25 .75"});
}

TEST_F(Msh, PartitionedEntitiesHaveTheirGroups) {
  std::string text = version_41();
  const std::string end = "$EndEntities\n";
  text.insert(text.find(end) + end.size(),
              "$PartitionedEntities\n2\n1\n5 2\n0 0 1 1\n1 2 1 2 1 2 0 0 0 1 1 0 1 8 1 4\n"
              "3 3 1 1 2 0 0 0 1 1 1 2 9 -11 0\n$EndPartitionedEntities\n");
  text.replace(text.find("3 2 4 1\n207"), 7, "3 3 4 1");  // the second one is in entity 3 now
  const MeshFile file = read(text);
  EXPECT_THAT(ids_of_set(file, "11"), ElementsAre(20, 30, 40, 50));
  EXPECT_THAT(ids_of_set(file, "rock"), ElementsAre(10, 20, 30, 40, 50));
  EXPECT_EQ(find_regions(file).count, 2U);
}

// Gmsh takes all elements of an entity for members of each group that one of them is in.
TEST_F(Msh, BeforeVersion4AnElementIsInItsOwnGroup) {
  std::string text = version_2("2.2");
  const std::string row = "207 4 5 9 2 2 1 -3";
  text.replace(text.find(row), row.size(), "207 4 2 8 1");
  const MeshFile file = read(text);
  EXPECT_THAT(ids_of_set(file, "rock"), ElementsAre(10, 20, 30, 40));
  EXPECT_THAT(ids_of_set(file, "8"), ElementsAre(20, 30, 40, 50));
  EXPECT_EQ(find_regions(file).count, 2U);
}

TEST_F(Msh, DataSectionsAreArraysOfTheirFirstStep) {
  const auto data = [](const std::string& name, const std::string& integers,
                       const std::string& rows, const std::string& section = "NodeData") {
    return "$" + section + "\n1\n\"" + name + "\"\n1\n0.5\n" + integers + "\n" + rows + "$End" +
           section + "\n";
  };
  const MeshFile file = read(
      version_2("2.2") + data("flow", "3\n0\n3\n2", "10 1 2 3\n30 4 5 6\n") +
      data("heat", "4\n2\n1\n1\n1", "10 1.5\n") + data("heat", "4\n2\n1\n1\n2", "20 2.5\n") +
      data("heat", "3\n3\n1\n1", "20 9\n") + data("part", "3\n0\n1\n1", "207 4\n", "ElementData") +
      data("stress", "3\n0\n1\n1", "205 4 1 2 3 4\n", "ElementNodeData"));
  const auto flow = find_node_vectors(file, "flow");
  EXPECT_EQ(flow[0].y, 2);
  EXPECT_EQ(flow[2].z, 6);
  EXPECT_TRUE(std::isnan(flow[1].x));
  EXPECT_THAT(ids_of_set(file, "heat"), ElementsAre(10, 20));
  EXPECT_EQ(file.content()->dataset->node_column("heat")->values[1], 2.5);
  EXPECT_EQ(file.content()->dataset->cell_column("part")->values[2], 4);
}

// As in a tutorial of Gmsh's.
TEST_F(Msh, AnEndMayBeMisspelt) {
  const MeshFile file = read(
      version_2("2.2") + "$ElementData\n1\n\"part\"\n1\n0\n3\n0\n1\n1\n207 4\n$EndElememtData\n" +
      "$Own\n$EndOwn\n");
  EXPECT_EQ(file.content()->dataset->cell_column("part")->values[2], 4);
}

TEST_F(Msh, BinaryDataIsRead) {
  Bytes data(true);
  data.text("$NodeData\n1\n\"heat\"\n1\n0\n3\n0\n1\n2\n");
  data.integers({10}).reals({1.5}).integers({50}).reals({-2}).text("\n$EndNodeData\n");
  EXPECT_THAT(ids_of_set(read(binary_2(true) + data.all()), "heat"), ElementsAre(10, 50));
}

TEST_F(Msh, CellsThatCannotBeSmoothedHoldTheirNodes) {
  std::string text = version_2("2.2");
  text.replace(text.find("3\n101"), 1, "5");
  text.insert(text.find("$EndElements"),
              "300 35 2 9 1 8 10 20 30 40 40 30 20 99\n301 140 2 9 1 20 30 40 50\n");
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.element_count(), 2U);
  ASSERT_EQ(file.held_cells().size(), 2U);
  EXPECT_EQ(file.held_cells()[0].name, "polyhedron");
  EXPECT_EQ(file.held_cells()[1].name, "Trihedron 4");
  EXPECT_THAT(file.mesh.fixed, ElementsAre(1, 1, 1, 1, 1, 1));
  EXPECT_THAT(ids_of_set(file, "wall"), ElementsAre(10, 20, 30));

  const MeshFile plane = read(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 .5 2 0\n"
      "5 0 1 0\n6 2 0 0\n$EndNodes\n$Elements\n2\n1 34 2 0 1 5 1 2 3 4 5\n2 2 2 0 1 2 6 3\n"
      "$EndElements\n");
  EXPECT_EQ(plane.held_cells().at(0).name, "polygon");
  EXPECT_THAT(plane.mesh.fixed, ElementsAre(1, 1, 1, 1, 1, 0));
}

// Gmsh 2.10 to 3.0, where Mesh.MshFileVersion is 3.
TEST_F(Msh, VersionThreeIsRead) {
  const std::string text =
      "$MeshFormat\n3 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 7 \"rim\"\n2 8 \"sheet\"\n"
      "$EndPhysicalNames\n$Entities\n1 1 2 0\n1 0\n1 2 1 1 1 7\n3 1 1 1 -8\n4 0 0\n$EndEntities\n"
      "$Nodes\n5\n10 0 0 0 0\n20 1 0 0 1 1 0.5\n30 1 1 0 3 2 0.5 0.5\n40 0 1 0\n50 2 2 0 0\n"
      "$EndNodes\n$Elements\n4\n101 1 1 2 10 20\n102 2 3 3 10 20 30\n103 2 4 6 10 30 40 102 1 1\n"
      "104 135 4 4 20 50 30 103\n$EndElements\n";
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.element_count(), 2U);
  EXPECT_EQ(file.mesh.node_count(), 5U);
  EXPECT_THAT(ids_of_set(file, "rim"), ElementsAre(10, 20));
  EXPECT_THAT(ids_of_set(file, "sheet"), ElementsAre(10, 20, 30));
  ASSERT_EQ(file.held_cells().size(), 1U);
  EXPECT_EQ(file.held_cells()[0].name, "Triangle Sub");
  EXPECT_THAT(file.mesh.fixed, ElementsAre(0, 1, 1, 0, 1));
}

TEST_F(Msh, ElementsOfHigherOrderHoldTheirNodes) {
  std::string text = version_2("2.2");
  text.replace(text.find("3\n101"), 1, "5");
  text.insert(text.find("$EndElements"),
              "300 14 2 9 1 10 20 30 40 50 10 20 30 40 50 10 20 30 40\n301 26 2 9 1 20 30 40 50\n");
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.element_count(), 2U);
  ASSERT_EQ(file.held_cells().size(), 2U);
  EXPECT_EQ(file.held_cells()[0].name, "Pyramid 14");
  EXPECT_EQ(file.held_cells()[1].name, "Line 4");
}

TEST_F(Msh, NumbersOfNodesMayBeAnything) {
  std::string text = version_2("2.2");
  const auto replace_all = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
  };
  replace_all("\n99 ", "\n5000000000 ");
  replace_all("\n10 ", "\n0 ");
  replace_all(" 10 ", " 0 ");
  const MeshFile file = read(text);
  EXPECT_THAT(file.mesh.blocks[0].nodes, ElementsAre(0, 1, 2, 3, 1, 4, 2, 3));
  EXPECT_EQ(file.file_node_id(0), 0);
  EXPECT_EQ(file.file_node_id(5), 5000000000);
}

}  // namespace
}  // namespace meshsmooth::formats

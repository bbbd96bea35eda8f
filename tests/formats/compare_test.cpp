#include "compare.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "content.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Two tetrahedra with all that a file of a library may carry.
MeshFile file_with(const std::function<void(FileContent&, PlainDataset&)>& change = {}) {
  auto dataset = std::make_shared<PlainDataset>(test::two_tets());
  FileContent content;
  content.extension = ".own";
  content.node_ids = {10, 20, 30, 40, 50};
  content.cell_ids = {7, 8};
  content.groups = {{3, "steel", kPhysicalArray, {1}}};
  content.group_sets = {1, 0};
  content.node_sets = {{"inlet", {0, 1}}, {"wall", {2}}};
  dataset->add_node_column({"pressure", false, {1, 2, 3, 4, 5}});
  dataset->add_cell_column({"part", true, {1, 2}});
  if (change) change(content, *dataset);
  content.dataset = dataset;
  return make_mesh_file("file.own", std::move(content));
}

std::vector<std::string> differences(
    const std::function<void(FileContent&, PlainDataset&)>& change) {
  return compare_files(file_with(), file_with(change)).differences;
}

TEST(Compare, FindsNothingWhereCoordinatesAloneDiffer) {
  MeshFile moved = file_with();
  std::get<std::vector<Vec3d>>(moved.mesh.positions)[3].z += 1;
  const FileDifference difference = compare_files(file_with(), moved);
  EXPECT_EQ(difference.compared_by, ComparedBy::arrays);
  EXPECT_TRUE(difference.same_topology);
  EXPECT_TRUE(difference.only_coordinates());
}

TEST(Compare, NamesEachKindOfDifference) {
  EXPECT_THAT(differences({}), IsEmpty());
  EXPECT_THAT(differences([](auto& content, auto&) { content.node_ids[1] = 21; }),
              ElementsAre("node ids"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.cell_ids[1] = 9; }),
              ElementsAre("element ids"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.groups[0].values = {2}; }),
              ElementsAre("group: steel"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.groups.clear(); }),
              ElementsAre("group: steel"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.group_sets[1] = 1; }),
              ElementsAre("elements of groups"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.node_sets[1].nodes = {3}; }),
              ElementsAre("node set: wall"));
  EXPECT_THAT(differences([](auto& content, auto&) { content.node_sets[0].name = "outlet"; }),
              ElementsAre("node set: inlet"));
  EXPECT_THAT(differences([](auto&, PlainDataset& dataset) {
                dataset.add_cell_column({"more", true, {1, 2}});
              }),
              ElementsAre("cell array more: only in the second file"));
}

TEST(Compare, TakesFilesOfDifferentFormatsAsMeshes) {
  const MeshFile other = file_with([](auto& content, auto&) {
    content.extension = ".other";
    content.node_ids.clear();
  });
  const FileDifference difference = compare_files(file_with(), other);
  EXPECT_EQ(difference.compared_by, ComparedBy::meshes);
  EXPECT_TRUE(difference.only_coordinates());
}

TEST(Compare, TakesTextsOutsideTheirCoordinates) {
  const auto with_text = [](const std::string& text, std::size_t second) {
    return file_with([&](auto& content, auto&) {
      content.text = text;
      const CoordinateFields::Field first{2, 3};
      content.fields.fields = {{first, CoordinateFields::Field{6, 1}, {second, 1}}};
    });
  };
  const MeshFile before = with_text("v 1.5 2 3\nend\n", 8);
  EXPECT_TRUE(compare_files(before, with_text("v 9.9 7 1\nend\n", 8)).only_coordinates());
  EXPECT_THAT(compare_files(before, with_text("v 1.5 2  3\nend\n", 9)).differences,
              ElementsAre("text: from line 1, byte 8"));
  EXPECT_THAT(compare_files(before, with_text("v 1.5 2 3\nEnd\n", 8)).differences,
              ElementsAre("text: from line 2, byte 10"));
  EXPECT_THAT(compare_files(before, with_text("v 1.5 2 3\nend\n\n", 8)).differences,
              ElementsAre("text: from line 3, byte 14"));
}

}  // namespace
}  // namespace meshsmooth::formats

#include "spare_memory.hpp"

#include <gtest/gtest.h>

#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

constexpr std::size_t kMany = 100'000;  // 2.4 MB

Mesh mesh_of(std::size_t node_count) {
  Mesh mesh;
  mesh.positions = std::vector<Vec3d>(node_count);
  return mesh;
}
std::size_t room(const Positions& memory) {
  return std::visit([](const auto& places) { return places.capacity(); }, memory);
}

TEST(SpareMemory, IsGivenOnce) {
  SpareMemory spare;
  spare.keep(std::vector<Vec3d>(kMany));

  EXPECT_EQ(room(spare.take(mesh_of(kMany))), kMany);
  EXPECT_EQ(room(spare.take(mesh_of(kMany))), 0);
}

TEST(SpareMemory, IsOfAboutTheSizeThatIsNeeded) {
  SpareMemory spare;
  spare.keep(std::vector<Vec3d>(kMany));
  spare.keep(std::vector<Vec3d>(2 * kMany));

  EXPECT_EQ(room(spare.take(mesh_of(kMany + 1))), 0);
  EXPECT_EQ(room(spare.take(mesh_of(kMany * 3 / 4))), 0);
  EXPECT_EQ(room(spare.take(mesh_of(kMany * 9 / 10))), kMany);
  EXPECT_EQ(room(spare.take(mesh_of(2 * kMany))), 2 * kMany);
}

TEST(SpareMemory, IsOfTheMeshsPrecision) {
  SpareMemory spare;
  spare.keep(std::vector<Vec3f>(kMany));

  EXPECT_EQ(room(spare.take(mesh_of(kMany))), 0);
  Mesh floats;
  floats.positions = std::vector<Vec3f>(kMany);
  EXPECT_EQ(room(spare.take(floats)), kMany);
}

Positions reserved(std::size_t node_count) {
  std::vector<Vec3d> places;
  places.reserve(node_count);
  return places;
}

TEST(SpareMemory, ForgetsTheOldestBeyondItsLimit) {
  constexpr std::size_t kThird = SpareMemory::kMostBytes / 3 / sizeof(Vec3d);
  constexpr std::size_t kLess = kThird * 7 / 10;
  SpareMemory spare;
  spare.keep(reserved(kThird));
  for (int i = 0; i < 3; ++i) spare.keep(reserved(kLess));

  EXPECT_EQ(room(spare.take(mesh_of(kThird))), 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(room(spare.take(mesh_of(kLess))), kLess);
}

TEST(SpareMemory, KeepsNothingTinyOrHuge) {
  SpareMemory spare;
  spare.keep(reserved(1000));
  spare.keep(reserved(kMany));
  spare.keep(reserved(SpareMemory::kMostBytes / sizeof(Vec3d) + 1));

  EXPECT_EQ(room(spare.take(mesh_of(1000))), 0);
  EXPECT_EQ(room(spare.take(mesh_of(kMany))), kMany);
}

}  // namespace
}  // namespace meshsmooth::client

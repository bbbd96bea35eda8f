#include "buffer_cache.hpp"

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
  return std::visit([](const auto& positions) { return positions.capacity(); }, memory);
}

TEST(BufferCache, IsGivenOnce) {
  BufferCache cache;
  cache.keep(std::vector<Vec3d>(kMany));

  EXPECT_EQ(room(cache.take(mesh_of(kMany).positions_view())), kMany);
  EXPECT_EQ(room(cache.take(mesh_of(kMany).positions_view())), 0);
}

TEST(BufferCache, IsOfAboutTheSizeThatIsNeeded) {
  BufferCache cache;
  cache.keep(std::vector<Vec3d>(kMany));
  cache.keep(std::vector<Vec3d>(2 * kMany));

  EXPECT_EQ(room(cache.take(mesh_of(kMany + 1).positions_view())), 0);
  EXPECT_EQ(room(cache.take(mesh_of(kMany * 3 / 4).positions_view())), 0);
  EXPECT_EQ(room(cache.take(mesh_of(kMany * 9 / 10).positions_view())), kMany);
  EXPECT_EQ(room(cache.take(mesh_of(2 * kMany).positions_view())), 2 * kMany);
}

TEST(BufferCache, IsOfTheMeshsPrecision) {
  BufferCache cache;
  cache.keep(std::vector<Vec3f>(kMany));

  EXPECT_EQ(room(cache.take(mesh_of(kMany).positions_view())), 0);
  Mesh floats;
  floats.positions = std::vector<Vec3f>(kMany);
  EXPECT_EQ(room(cache.take(floats.positions_view())), kMany);
}

Positions reserved(std::size_t node_count) {
  std::vector<Vec3d> positions;
  positions.reserve(node_count);
  return positions;
}

TEST(BufferCache, ForgetsTheOldestBeyondItsLimit) {
  constexpr std::size_t kThird = BufferCache::kMostBytes / 3 / sizeof(Vec3d);
  constexpr std::size_t kLess = kThird * 7 / 10;
  BufferCache cache;
  cache.keep(reserved(kThird));
  for (int i = 0; i < 3; ++i) cache.keep(reserved(kLess));

  EXPECT_EQ(room(cache.take(mesh_of(kThird).positions_view())), 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(room(cache.take(mesh_of(kLess).positions_view())), kLess);
}

TEST(BufferCache, KeepsNothingTinyOrHuge) {
  BufferCache cache;
  cache.keep(reserved(1000));
  cache.keep(reserved(kMany));
  cache.keep(reserved(BufferCache::kMostBytes / sizeof(Vec3d) + 1));

  EXPECT_EQ(room(cache.take(mesh_of(1000).positions_view())), 0);
  EXPECT_EQ(room(cache.take(mesh_of(kMany).positions_view())), kMany);
}

}  // namespace
}  // namespace meshsmooth::client

// Many meshes by one call: in order, each as it is alone, and a bad one fails alone.
#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "client_access.hpp"
#include "meshsmooth/smoother.hpp"
#include "support/in_process_server.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

using meshsmooth::testing::InProcessServer;

Client connect(InProcessServer& server) { return ClientAccess::make(server.channel()); }

std::vector<Mesh> meshes_with_a_bad_one(std::size_t count, std::size_t bad) {
  std::vector<Mesh> meshes(count, test::tet_ball());
  for (std::size_t i = 0; i < count; ++i) test::points(meshes[i])[0].x = static_cast<double>(i);
  meshes[bad].blocks.clear();
  return meshes;
}

TEST(SmoothMany, ABadMeshFailsAloneAndInItsPlace) {
  InProcessServer server;
  Client client = connect(server);
  constexpr std::size_t kCount = 40, kBad = 17;
  std::vector<Mesh> meshes = meshes_with_a_bad_one(kCount, kBad);
  std::size_t expected = 0;
  const auto caller = std::this_thread::get_id();
  client.smooth_many(meshes, {}, {}, [&](std::size_t index, const SmoothOutcome& outcome) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_EQ(index, expected++);
    Mesh alone = meshes_with_a_bad_one(kCount, kBad)[index];
    if (index == kBad) {
      ASSERT_TRUE(std::holds_alternative<std::exception_ptr>(outcome));
      try {
        std::rethrow_exception(std::get<std::exception_ptr>(outcome));
      } catch (const std::exception& error) {
        EXPECT_THAT(error.what(), ::testing::HasSubstr("element"));
      }
      EXPECT_EQ(test::points(meshes[index])[1], test::points(alone)[1]);
    } else {
      ASSERT_TRUE(std::holds_alternative<SmoothReport>(outcome));
      client.smooth(alone, {});
      EXPECT_EQ(test::points(meshes[index]), test::points(alone));
    }
  });
  EXPECT_EQ(expected, kCount);
  client.smooth_many({}, {}, {}, [](std::size_t, const SmoothOutcome&) { FAIL(); });
}

TEST(SmoothMany, WhatTheCallerThrowsEndsTheRest) {
  InProcessServer server;
  server.fake().hold();
  Client client = connect(server);
  std::vector<Mesh> meshes(30, test::tet_ball());
  meshes[0].blocks.clear();
  EXPECT_THROW(client.smooth_many(
                   meshes, {}, {},
                   [](std::size_t, const SmoothOutcome&) { throw std::out_of_range("enough"); }, 3),
               std::out_of_range);
}

TEST(SmoothMany, AStopTokenCancelsAll) {
  InProcessServer server;
  server.fake().hold();
  Client client = connect(server);
  std::vector<Mesh> meshes(8, test::tet_ball());
  std::stop_source stop;
  RequestOptions request;
  request.stop = stop.get_token();
  request.on_progress = [&](const JobProgress&) { stop.request_stop(); };
  int cancelled = 0;
  client.smooth_many(meshes, {}, request, [&](std::size_t, const SmoothOutcome& outcome) {
    cancelled += std::holds_alternative<std::exception_ptr>(outcome) ? 1 : 0;
  });
  EXPECT_EQ(cancelled, 8);
}

TEST(SmoothMany, RefusesOneIdForAllAndNoRoom) {
  InProcessServer server;
  Client client = connect(server);
  std::vector<Mesh> meshes(2, test::tet_ball());
  const auto ignore = [](std::size_t, const SmoothOutcome&) {};
  RequestOptions request;
  request.request_id = "8d2b3c5e-3c1d-4c57-9a53-bb5a5f7b4a11";
  EXPECT_THROW(client.smooth_many(meshes, {}, request, ignore), InvalidOption);
  EXPECT_THROW(client.smooth_many(meshes, {}, {}, ignore, 0), InvalidOption);
}

}  // namespace
}  // namespace meshsmooth::client

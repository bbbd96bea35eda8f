// Target surfaces on their way from the client library to a smoother and back.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "meshsmooth/client.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/smoother.hpp"
#include "support/both_ways.hpp"
#include "support/fit_surfaces.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::client {
namespace {

constexpr int kCells = 16;  // a side: large enough to travel through shared memory

SmoothOptions sliding() {
  SmoothOptions options;
  options.max_iterations = 2;
  options.boundary = BoundaryPolicy::slide;
  return options;
}
SurfaceMesh larger_box() { return test::box_surface(4, {16.5, 16.5, 16.5}); }

class TargetSurfaces : public testing::BothWays {
 protected:
  const Mesh mesh_ = test::lattice(ElementType::tetrahedron, kCells);
};

INSTANTIATE_TEST_SUITE_P(Ways, TargetSurfaces, ::testing::Bool(), testing::way_name);

TEST_P(TargetSurfaces, TravelWithAJob) {
  SurfaceMesh surface = larger_box();
  // A patch of its own, with a border of four curves.
  surface.patches.assign(surface.triangles.size(), 1);
  surface.patches[0] = surface.patches[1] = 2;
  const JobInput input{.surface = &surface};
  Mesh here = mesh_;
  const SmoothSummary expected = make_smoother("cpu")->smooth(here, sliding(), {}, input);
  ASSERT_TRUE(expected.fit);
  EXPECT_EQ(expected.fit->surface.patches, 7);
  Client client(target());
  EXPECT_TRUE(goes_its_way([&] {
    Mesh mesh = mesh_;
    const SmoothReport report = client.smooth(mesh, sliding(), request(), input);
    EXPECT_EQ(mesh.positions, here.positions) << "as without a server";
    EXPECT_TRUE(report.summary.fit);
    if (report.summary.fit) {
      EXPECT_EQ(report.summary.fit->reached_count, expected.fit->reached_count);
      EXPECT_EQ(report.summary.fit->surface.patches, 7);
      EXPECT_EQ(report.summary.fit->parts.size(), expected.fit->parts.size());
    }
    return report;
  }));
}

TEST_P(TargetSurfaces, AreRefusedByName) {
  Client client(target());
  const auto reason_of = [&](const SurfaceMesh& surface, const SmoothOptions& options) {
    Mesh mesh = mesh_;
    try {
      client.smooth(mesh, options, request(), {.surface = &surface});
    } catch (const Error& error) {
      EXPECT_EQ(mesh.positions, mesh_.positions);
      return error.reason();
    }
    return std::string();
  };
  SurfaceMesh surface = larger_box();
  EXPECT_EQ(reason_of(surface, {}), "OPTION_NOT_SUPPORTED") << "the boundary is fixed";
  SurfaceMesh broken = surface;
  broken.triangles[3][1] = -1;
  EXPECT_EQ(reason_of(broken, sliding()), "SURFACE_INVALID");
  broken = surface;
  broken.points[3].y = NAN;
  EXPECT_EQ(reason_of(broken, sliding()), "SURFACE_INVALID");
  broken = surface;
  broken.patches = {1, 2};
  EXPECT_EQ(reason_of(broken, sliding()), "SURFACE_INVALID");
  broken = surface;
  for (Vec3d& p : broken.points) p.z = p.x;
  for (Vec3d& p : broken.points) p.y = p.x;
  EXPECT_EQ(reason_of(broken, sliding()), "SURFACE_INVALID") << "the server finds no area";
  EXPECT_EQ(reason_of({}, sliding()), "SURFACE_INVALID");
  EXPECT_EQ(reason_of(surface, sliding()), "");
}

}  // namespace
}  // namespace meshsmooth::client

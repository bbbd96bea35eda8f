#pragma once

// The jobs that tests run on prepared topologies, of every backend.

#include <gtest/gtest.h>

#include <vector>

#include "core/smoothing.hpp"
#include "meshsmooth/error.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::test {

/// Four sweeps by each step that reads what was prepared.
inline std::vector<SmoothOptions> prepared_ways() {
  std::vector<SmoothOptions> ways;
  const auto add = [&](const Method& method, const auto& change) {
    SmoothOptions options;
    options.method = method;
    options.max_iterations = 4;
    options.tolerance = {.value = 0, .relative = false};
    change(options);
    ways.push_back(options);
  };
  const auto as_is = [](SmoothOptions&) {};
  add(Laplacian{}, as_is);
  add(Laplacian{}, [](SmoothOptions& o) { o.guard = false; });
  add(Laplacian{.weighting = Weighting::ball_volume}, as_is);
  add(SmartLaplacian{}, as_is);
  add(Taubin{}, as_is);
  add(HcLaplacian{}, as_is);
  add(Optimize{}, as_is);
  add(SmartLaplacian{}, [](SmoothOptions& o) { o.boundary = BoundaryPolicy::slide; });
  add(SmartLaplacian{}, [](SmoothOptions& o) { o.boundary = BoundaryPolicy::free; });
  return ways;
}

/// The result of a job in place, and what was given is as it was: on the bare topology and on the
/// prepared one. Arrays that do not fit each other are refused.
inline void reads_one_array_and_writes_another(Smoother& smoother, const Mesh& mesh) {
  const MeshTopology topology(mesh);
  const auto prepared = smoother.prepare(topology.view());
  for (const SmoothOptions& options : prepared_ways()) {
    SCOPED_TRACE(method_name(options.method));
    Mesh in_place = mesh, given = mesh, result = noisy(mesh, 0.3, 9);
    smoother.smooth(topology.view(), in_place.positions_span(), options, {});
    smoother.smooth(topology.view(), {given.positions_view(), result.positions_span()}, options,
                    {});
    EXPECT_TRUE(same_bits(result, in_place));
    EXPECT_TRUE(same_bits(given, mesh));
    in_place = mesh;
    result = noisy(mesh, 0.3, 10);
    smoother.smooth(*prepared, in_place.positions_span(), options, {});
    smoother.smooth(*prepared, {given.positions_view(), result.positions_span()}, options, {});
    EXPECT_TRUE(same_bits(result, in_place));
    EXPECT_TRUE(same_bits(given, mesh));
    result = mesh;
    JobPositions written_early(result.positions_span());
    written_early.kept_on_error = false;
    smoother.smooth(*prepared, written_early, options, {});
    EXPECT_TRUE(same_bits(result, in_place));
  }
  Mesh result = mesh;
  const std::vector<Vec3d> few(mesh.node_count() - 1);
  const std::vector<Vec3f> other(mesh.node_count());
  EXPECT_THROW(smoother.smooth(*prepared, {std::span(few), result.positions_span()}, {}, {}),
               InvalidMesh);
  EXPECT_THROW(smoother.smooth(*prepared, {std::span(other), result.positions_span()}, {}, {}),
               InvalidOption);
  EXPECT_TRUE(same_bits(result, mesh));
}

}  // namespace meshsmooth::test

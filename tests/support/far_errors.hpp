#pragma once

// Meshes whose errors are far from their cure, or few in a large mesh.

#include <functional>
#include <string>
#include <vector>

#include "generate/cases.hpp"
#include "meshsmooth/options.hpp"
#include "node_sets.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::test {

struct FarError {
  std::string name;
  std::function<Mesh()> mesh;
  BoundaryPolicy boundary = BoundaryPolicy::fixed;
  double least_mean_ratio = 0;  // of the result, at least
};

/// The mesh with the set of its file that the caller fixes.
inline Mesh with_fixed_set(const formats::MeshFile& file) {
  Mesh mesh = file.mesh;
  mesh.fixed.assign(mesh.node_count(), 0);
  for (const NodeId node : formats::find_node_set(file, formats::kFixedArray)) {
    mesh.fixed[static_cast<std::size_t>(node)] = 1;
  }
  return mesh;
}

inline FarError hub(int rows, double degrees, double least_mean_ratio) {
  return {"hub of " + std::to_string(rows) + " rows, " + std::to_string(int(degrees)) + " degrees",
          [=] { return formats::generate_hub({.rows = rows, .degrees = degrees}).mesh; },
          BoundaryPolicy::fixed, least_mean_ratio};
}

/// A cube of `cells`³ jittered cubes of six tetrahedra each, its boundary moved.
inline FarError moved_cube(const std::string& name, int cells, const formats::CubeMotion& motion) {
  return {name + " of " + std::to_string(cells) + " cells", [=] {
            const Mesh cube = noisy(lattice(ElementType::tetrahedron, cells), 0.25, 5);
            Mesh moved = mapped(cube, [=](Vec3d p) { return (1.0 / cells) * p; });
            formats::move_cube_boundary(moved, motion);
            return moved;
          }};
}

/// `scale` 1: small enough for a CPU in a test; 2: as large as the goals are.
inline std::vector<FarError> far_errors(int scale) {
  std::vector<FarError> cases = {
      hub(12, 30, 0.8),
      hub(24, 30, 0.8),
      hub(48, 30, 0.8),
      hub(24, 60, 0.6),
      hub(48 * scale, 10, 0.8),
      {"bar turned by 180 degrees, sides free",
       [] { return with_fixed_set(formats::generate_bar({.degrees = 180})); }, BoundaryPolicy::free,
       0.2},
      moved_cube("squeeze of a cube", 10 * scale, {.squeeze = 0.2}),
      moved_cube("bend of a cube", 10 * scale, {.bend = 120}),
      moved_cube("twist of a cube", 10 * scale, {.twist = 180})};
  if (scale > 1) {
    cases.push_back(hub(96, 15, 0.8));
    cases.push_back(hub(96, 30, 0.8));
  }
  return cases;
}

}  // namespace meshsmooth::test

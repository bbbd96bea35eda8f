#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>

#include "meshsmooth/target_surface.hpp"

namespace meshsmooth::test {

/// The surface of unit cells of a lattice of n x n x n that are `inside`, each side as
/// two triangles, mapped.
inline SurfaceMesh surface_of_cells(int n, const std::function<bool(int, int, int)>& inside,
                                    const std::function<Vec3d(Vec3d)>& map) {
  SurfaceMesh mesh;
  std::map<std::tuple<int, int, int>, std::int32_t> ids;
  const auto id = [&](int x, int y, int z) {
    const auto [at, is_new] =
        ids.try_emplace({x, y, z}, static_cast<std::int32_t>(mesh.points.size()));
    if (is_new) mesh.points.push_back(map({double(x), double(y), double(z)}));
    return at->second;
  };
  const auto is_inside = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < n && y < n && z < n && inside(x, y, z);
  };
  for (int x = 0; x < n; ++x) {
    for (int y = 0; y < n; ++y) {
      for (int z = 0; z < n; ++z) {
        if (!is_inside(x, y, z)) continue;
        for (int side = 0; side < 6; ++side) {
          const int axis = side / 2, up = side % 2;
          int step[3] = {0, 0, 0};
          step[axis] = up == 1 ? 1 : -1;
          if (is_inside(x + step[0], y + step[1], z + step[2])) continue;
          std::int32_t corners[4];
          for (int k = 0; k < 4; ++k) {
            int at[3] = {x, y, z};
            at[axis] += up;
            at[(axis + 1) % 3] += k == 1 || k == 2 ? 1 : 0;
            at[(axis + 2) % 3] += k >= 2 ? 1 : 0;
            corners[up == 1 ? k : 3 - k] = id(at[0], at[1], at[2]);
          }
          mesh.triangles.push_back({corners[0], corners[1], corners[2]});
          mesh.triangles.push_back({corners[0], corners[2], corners[3]});
        }
      }
    }
  }
  return mesh;
}

/// Of a box with a corner at the origin; n x n squares a side.
inline SurfaceMesh box_surface(int n, Vec3d size) {
  return surface_of_cells(
      n, [](int, int, int) { return true; },
      [=](Vec3d p) {
        return Vec3d{size.x * p.x / n, size.y * p.y / n, size.z * p.z / n};
      });
}

/// Of the unit cube without the quarter beyond x, z > 1/2; 2 n squares a side.
inline SurfaceMesh l_surface(int n) {
  return surface_of_cells(
      2 * n, [=](int x, int, int z) { return x < n || z < n; },
      [=](Vec3d p) { return (0.5 / n) * p; });
}

/// A sphere around the origin: the sides of a cube of n x n squares blown up.
inline SurfaceMesh sphere_surface(int n, double radius) {
  return surface_of_cells(
      n, [](int, int, int) { return true; },
      [=](Vec3d p) {
        const auto angle = [=](double x) { return std::tan((x / n - 0.5) * std::numbers::pi / 2); };
        const Vec3d q{angle(p.x), angle(p.y), angle(p.z)};
        return (radius / norm(q)) * q;
      });
}

}  // namespace meshsmooth::test

#pragma once

#include "smooth/base/executor.hpp"
#include "surface/surface_trees.hpp"

namespace meshsmooth::detail {

/// Owns a copy of a surface in executor memory.
template <Executor E>
struct SurfaceBuffers {
  SurfaceBuffers() = default;
  SurfaceBuffers(E& executor, const SurfaceTrees& trees)
      : points(copy(executor, trees.points())),
        items(copy(executor, trees.items())),
        boxes(copy(executor, trees.boxes())),
        roots(copy(executor, trees.roots())),
        corners(copy(executor, trees.features().corners)),
        view(trees.view()) {
    view.points = points.data();
    view.items = items.data();
    view.boxes = boxes.data();
    view.roots = roots.data();
    view.corners = corners.data();
  }

  typename E::template Buffer<Vec3d> points;
  typename E::template Buffer<SurfaceItem> items;
  typename E::template Buffer<BoxNode> boxes;
  typename E::template Buffer<std::int32_t> roots;
  typename E::template Buffer<std::int32_t> corners;
  SurfaceView view{};

 private:
  template <class T>
  static typename E::template Buffer<T> copy(E& executor, const std::vector<T>& host) {
    auto result = executor.template allocate<T>(host.size());
    executor.upload(host.data(), host.size(), result.data());
    return result;
  }
};

}  // namespace meshsmooth::detail

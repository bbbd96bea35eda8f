#pragma once

#include <cmath>
#include <cstdint>

#include "surface/closest.hpp"

namespace meshsmooth::detail {

/// A triangle of a patch or, without a third point, a segment of a curve.
struct SurfaceItem {
  std::int32_t points[3];
  std::int32_t entity;
};

/// A box of a tree, in preorder: the left child of an inner box is the next one.
struct BoxNode {
  float lower[3], upper[3];  // rounded outwards
  std::int32_t link;         // of a leaf its first item, else the right child
  std::int32_t count;        // items of a leaf; 0 of inner boxes
};

/// A surface in executor memory. Its entities are the patches, then the curves, then the corners.
struct SurfaceView {
  static constexpr int kMostDepth = 48;  // of a tree
  // That a search visits: some 50 for most nodes of CAD models, 475 at most.
  static constexpr int kMostBoxes = 1000;

  const Vec3d* points = nullptr;
  const SurfaceItem* items = nullptr;
  const BoxNode* boxes = nullptr;
  const std::int32_t* roots = nullptr;    // of each patch and curve; at last that of all patches
  const std::int32_t* corners = nullptr;  // points
  std::int32_t patch_count = 0;
  std::int32_t curve_count = 0;
  std::int32_t corner_count = 0;

  [[nodiscard]] MESHSMOOTH_HD std::int32_t all_patches() const { return patch_count + curve_count; }
  [[nodiscard]] MESHSMOOTH_HD bool is_patch(std::int32_t entity) const {
    return entity < patch_count;
  }
  [[nodiscard]] MESHSMOOTH_HD bool is_corner(std::int32_t entity) const {
    return entity >= patch_count + curve_count;
  }
  [[nodiscard]] MESHSMOOTH_HD Vec3d corner(std::int32_t entity) const {
    return points[corners[entity - patch_count - curve_count]];
  }
};

/// A position on a surface and the item that it lies on.
struct OnSurface {
  Closest closest;
  std::int32_t item = -1;
};

MESHSMOOTH_HD inline double squared_distance(const BoxNode& box, Vec3d p) {
  const double x[3] = {p.x, p.y, p.z};
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double below = box.lower[k] - x[k], above = x[k] - box.upper[k];
    const double off = below > above ? below : above;
    if (off > 0) sum += off * off;
  }
  return sum;
}

MESHSMOOTH_HD inline Closest closest_on_item(const SurfaceView& surface, const SurfaceItem& item,
                                             Vec3d p) {
  const Vec3d a = surface.points[item.points[0]], b = surface.points[item.points[1]];
  return item.points[2] < 0 ? closest_on_segment(a, b, p)
                            : closest_on_triangle(a, b, surface.points[item.points[2]], p);
}

/// The nearest position on the tree of `roots[tree]`; of several the first in its order.
/// O(log items) for a position near the surface. Where much of it is nearly as near, as from the
/// centre of a sphere, the search ends after `kMostBoxes` with one that is.
MESHSMOOTH_OUTLINE MESHSMOOTH_HD inline OnSurface closest_in_tree(const SurfaceView& surface,
                                                                  std::int32_t tree, Vec3d p) {
  OnSurface best{{p, HUGE_VAL, -1}, -1};
  std::int32_t open[SurfaceView::kMostDepth];
  int depth = 0;
  open[depth++] = surface.roots[tree];
  for (int visited = 0; depth > 0 && visited < SurfaceView::kMostBoxes; ++visited) {
    const std::int32_t at = open[--depth];
    const BoxNode& box = surface.boxes[at];
    if (!(squared_distance(box, p) < best.closest.squared)) continue;
    if (box.count == 0) {
      const std::int32_t left = at + 1, right = box.link;
      const bool left_first =
          squared_distance(surface.boxes[left], p) <= squared_distance(surface.boxes[right], p);
      open[depth++] = left_first ? right : left;
      open[depth++] = left_first ? left : right;
      continue;
    }
    for (std::int32_t i = box.link; i < box.link + box.count; ++i) {
      const Closest found = closest_on_item(surface, surface.items[i], p);
      if (found.squared < best.closest.squared) best = {found, i};
    }
  }
  return best;
}

/// The nearest position on a patch, a curve or a corner.
MESHSMOOTH_HD inline Vec3d closest_on_entity(const SurfaceView& surface, std::int32_t entity,
                                             Vec3d p) {
  return surface.is_corner(entity) ? surface.corner(entity)
                                   : closest_in_tree(surface, entity, p).closest.position;
}

/// The unit normal of an item that is a triangle; zero if it has no area.
MESHSMOOTH_HD inline Vec3d normal_of_item(const SurfaceView& surface, const SurfaceItem& item) {
  const Vec3d a = surface.points[item.points[0]];
  const Vec3d normal =
      cross(surface.points[item.points[1]] - a, surface.points[item.points[2]] - a);
  const double length = norm(normal);
  return length > 0 ? Vec3d{normal.x / length, normal.y / length, normal.z / length}
                    : Vec3d{0, 0, 0};
}

/// The unit direction of a curve, or the unit normal of a patch, at the item nearest to `p`; zero
/// at a corner.
MESHSMOOTH_HD inline Vec3d direction_at(const SurfaceView& surface, std::int32_t entity, Vec3d p) {
  if (surface.is_corner(entity)) return {0, 0, 0};
  const SurfaceItem& item = surface.items[closest_in_tree(surface, entity, p).item];
  if (item.points[2] >= 0) return normal_of_item(surface, item);
  const Vec3d along = surface.points[item.points[1]] - surface.points[item.points[0]];
  const double length = norm(along);
  return length > 0 ? (1 / length) * along : Vec3d{0, 0, 0};
}

}  // namespace meshsmooth::detail

#include "surface/surface_trees.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace meshsmooth::detail {
namespace {

constexpr std::size_t kLeaf = 4;  // items

[[nodiscard]] double coordinate(Vec3d p, int axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

}  // namespace

SurfaceTrees::SurfaceTrees(std::vector<Vec3d> points,
                           const std::vector<std::array<std::int32_t, 3>>& triangles,
                           SurfaceFeatures features, Checkpoint& checkpoint)
    : features_(std::move(features)), points_(std::move(points)) {
  std::vector<std::vector<std::int32_t>> of_patch(std::size_t(features_.patch_count));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    of_patch[std::size_t(features_.patch_of[t])].push_back(static_cast<std::int32_t>(t));
  }
  const auto add_triangle = [&](std::size_t t) {
    const auto& c = triangles[t];
    items_.push_back({{c[0], c[1], c[2]}, features_.patch_of[t]});
  };
  for (const auto& patch : of_patch) {
    const std::size_t first = items_.size();
    for (const std::int32_t t : patch) add_triangle(std::size_t(t));
    add_tree(first, checkpoint);
  }
  std::int32_t entity = features_.patch_count;
  for (const SurfaceCurve& curve : features_.curves) {
    const std::size_t first = items_.size();
    for (std::size_t n = 0; n + 1 < curve.points.size(); ++n) {
      items_.push_back({{curve.points[n], curve.points[n + 1], -1}, entity});
    }
    add_tree(first, checkpoint);
    ++entity;
  }
  const std::size_t first = items_.size();
  for (std::size_t t = 0; t < triangles.size(); ++t) add_triangle(t);
  add_tree(first, checkpoint);
}

SurfaceView SurfaceTrees::view() const {
  return {points_.data(),
          items_.data(),
          boxes_.data(),
          roots_.data(),
          features_.corners.data(),
          features_.patch_count,
          static_cast<std::int32_t>(features_.curves.size()),
          static_cast<std::int32_t>(features_.corners.size())};
}

void SurfaceTrees::add_tree(std::size_t first, Checkpoint& checkpoint) {
  roots_.push_back(static_cast<std::int32_t>(boxes_.size()));
  add_boxes(first, items_.size(), checkpoint);
}

/// Halves the items at the median of their centres along the longest side.
void SurfaceTrees::add_boxes(std::size_t first, std::size_t last, Checkpoint& checkpoint) {
  double lower[3], upper[3];
  std::fill_n(lower, 3, HUGE_VAL);
  std::fill_n(upper, 3, -HUGE_VAL);
  for (std::size_t i = first; i < last; ++i) {
    checkpoint();
    for (const std::int32_t p : items_[i].points) {
      if (p < 0) continue;
      for (int k = 0; k < 3; ++k) {
        const double x = coordinate(points_[std::size_t(p)], k);
        lower[k] = std::min(lower[k], x);
        upper[k] = std::max(upper[k], x);
      }
    }
  }
  BoxNode box{};
  int longest = 0;
  for (int k = 0; k < 3; ++k) {
    box.lower[k] = std::nextafterf(static_cast<float>(lower[k]), -HUGE_VALF);
    box.upper[k] = std::nextafterf(static_cast<float>(upper[k]), HUGE_VALF);
    if (upper[k] - lower[k] > upper[longest] - lower[longest]) longest = k;
  }
  const std::size_t own = boxes_.size();
  boxes_.push_back(box);
  if (last - first <= kLeaf) {
    boxes_[own].link = static_cast<std::int32_t>(first);
    boxes_[own].count = static_cast<std::int32_t>(last - first);
    return;
  }
  const auto centre = [&](const SurfaceItem& item) {
    double sum = 0;
    for (const std::int32_t p : item.points) {
      if (p >= 0) sum += coordinate(points_[std::size_t(p)], longest);
    }
    return sum / (item.points[2] < 0 ? 2 : 3);
  };
  const std::size_t middle = first + (last - first) / 2;
  const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last), [&](const auto& a, const auto& b) {
    checkpoint();
    const double x = centre(a), y = centre(b);
    return x != y ? x < y
                  : std::lexicographical_compare(a.points, a.points + 3, b.points, b.points + 3);
  });
  add_boxes(first, middle, checkpoint);
  boxes_[own].link = static_cast<std::int32_t>(boxes_.size());
  add_boxes(middle, last, checkpoint);
}

}  // namespace meshsmooth::detail

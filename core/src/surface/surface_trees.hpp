#pragma once

#include <cstdint>
#include <vector>

#include "surface/checkpoint.hpp"
#include "surface/features.hpp"
#include "surface/surface_view.hpp"

namespace meshsmooth::detail {

/// Owns what a `SurfaceView` points to, on the host, and the features it was made of.
class SurfaceTrees {
 public:
  SurfaceTrees(std::vector<Vec3d> points, const std::vector<std::array<std::int32_t, 3>>& triangles,
               SurfaceFeatures features, Checkpoint& checkpoint);

  [[nodiscard]] SurfaceView view() const;
  [[nodiscard]] const SurfaceFeatures& features() const { return features_; }

  [[nodiscard]] const std::vector<Vec3d>& points() const { return points_; }
  [[nodiscard]] const std::vector<SurfaceItem>& items() const { return items_; }
  [[nodiscard]] const std::vector<BoxNode>& boxes() const { return boxes_; }
  [[nodiscard]] const std::vector<std::int32_t>& roots() const { return roots_; }

 private:
  /// Appends a tree of the items from `first` on.
  void add_tree(std::size_t first, Checkpoint& checkpoint);
  void add_boxes(std::size_t first, std::size_t last, Checkpoint& checkpoint);

  SurfaceFeatures features_;
  std::vector<Vec3d> points_;
  std::vector<SurfaceItem> items_;
  std::vector<BoxNode> boxes_;
  std::vector<std::int32_t> roots_;
};

}  // namespace meshsmooth::detail

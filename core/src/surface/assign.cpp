#include "surface/assign.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "surface/curve_paths.hpp"

namespace meshsmooth::detail {
namespace {

/// The facet's nearest position on a surface, seen from it.
struct Near {
  std::int32_t patch;
  double cosine;  // of the angle between the normals
};

class Assigner {
 public:
  Assigner(const BoundaryMesh& boundary, const SurfaceTrees& surface,
           const std::function<void()>& check)
      : boundary_(boundary),
        view_(surface.view()),
        check_(check),
        paths_(find_curve_paths(boundary, surface, check)) {}

  [[nodiscard]] Assignment run() {
    find_parts();
    choose_patches();
    Assignment result;
    result.entities.assign(boundary_.node_count(), -1);
    for (std::size_t f = 0; f < part_of_.size(); ++f) {
      if (f % kChecked == 0) check_();
      for (const std::int32_t n : boundary_.facets()[f]) {
        if (n >= 0 && result.entities[std::size_t(n)] < 0) {
          result.entities[std::size_t(n)] = patch_for(n, patch_of_part_[std::size_t(part_of_[f])]);
        }
      }
    }
    for (std::size_t n = 0; n < boundary_.node_count(); ++n) {
      if (paths_.curve_of[n] >= 0) result.entities[n] = view_.patch_count + paths_.curve_of[n];
      if (paths_.corner_of[n] >= 0) {
        result.entities[n] = view_.patch_count + view_.curve_count + paths_.corner_of[n];
      }
    }
    result.next = std::move(paths_.next);
    result.unmatched_corners = paths_.unmatched_corners;
    result.unmatched_curves = paths_.unmatched_curves;
    result.bends = std::move(paths_.bends);
    return result;
  }

 private:
  static constexpr std::size_t kChecked = 100;  // searches between two checks

  /// Numbers the facets that are connected across edges in no path.
  void find_parts() {
    const auto facets = boundary_.facets();
    part_of_.assign(facets.size(), -1);
    std::vector<std::int32_t> open;
    for (std::size_t first = 0; first < facets.size(); ++first) {
      if (part_of_[first] >= 0) continue;
      part_of_[first] = part_count_;
      open.push_back(static_cast<std::int32_t>(first));
      while (!open.empty()) {
        const std::int32_t at = open.back();
        open.pop_back();
        visit_neighbours(at, [&](std::int32_t other) {
          if (part_of_[std::size_t(other)] >= 0) return;
          part_of_[std::size_t(other)] = part_count_;
          open.push_back(other);
        });
      }
      ++part_count_;
    }
  }

  template <class Visit>
  void visit_neighbours(std::int32_t facet, const Visit& visit) const {
    for (const std::int32_t e : boundary_.edges_of(facet)) {
      if (e < 0 || paths_.on_path[std::size_t(e)] != 0) continue;
      const BoundaryEdge& edge = boundary_.edges()[std::size_t(e)];
      if (edge.facets[1] < 0) continue;
      visit(edge.facets[edge.facets[0] == facet ? 1 : 0]);
    }
  }

  [[nodiscard]] Near nearest(const BoundaryFacet& facet) const {
    const OnSurface found = closest_in_tree(view_, view_.all_patches(), boundary_.centre(facet));
    const SurfaceItem& item = view_.items[found.item];
    const Vec3d own = boundary_.normal(facet);
    const double length = norm(own);
    return {item.entity, length > 0 ? dot(normal_of_item(view_, item), own) / length : 0};
  }

  /// The surface's orientation counts as a whole: it may be inside out.
  void choose_patches() {
    const auto facets = boundary_.facets();
    std::vector<Near> near(facets.size());
    double sum = 0;
    for (std::size_t f = 0; f < facets.size(); ++f) {
      if (f % kChecked == 0) check_();
      near[f] = nearest(facets[f]);
      sum += near[f].cosine * norm(boundary_.normal(facets[f]));
    }
    const double side = sum < 0 ? -1 : 1;
    std::vector<std::map<std::int32_t, double>> votes(static_cast<std::size_t>(part_count_));
    for (std::size_t f = 0; f < facets.size(); ++f) {
      constexpr double kLeast = 0.01;
      const double cosine = std::max(side * near[f].cosine, kLeast);
      votes[std::size_t(part_of_[f])][near[f].patch] +=
          cosine * cosine * norm(boundary_.normal(facets[f]));
    }
    for (const auto& part : votes) {
      const auto most = std::ranges::max_element(
          part, [](const auto& a, const auto& b) { return a.second < b.second; });
      patch_of_part_.push_back(most->first);
    }
  }

  [[nodiscard]] std::int32_t patch_for(std::int32_t n, std::int32_t patch) const {
    const Vec3d p = boundary_.points()[std::size_t(n)];
    const OnSurface nearest = closest_in_tree(view_, view_.all_patches(), p);
    const double far = std::sqrt(closest_in_tree(view_, patch, p).closest.squared);
    const double near = std::sqrt(nearest.closest.squared);
    return far <= 2 * near + 0.5 * boundary_.size_at(n) ? patch : view_.items[nearest.item].entity;
  }

  const BoundaryMesh& boundary_;
  SurfaceView view_;
  const std::function<void()>& check_;
  CurvePaths paths_;
  std::vector<std::int32_t> part_of_;  // by facet
  std::int32_t part_count_ = 0;
  std::vector<std::int32_t> patch_of_part_;
};

}  // namespace

Assignment assign(const BoundaryMesh& boundary, const SurfaceTrees& surface,
                  const std::function<void()>& check) {
  return Assigner(boundary, surface, check).run();
}

}  // namespace meshsmooth::detail

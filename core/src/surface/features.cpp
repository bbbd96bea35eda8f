#include "surface/features.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <span>
#include <utility>

namespace meshsmooth::detail {
namespace {

using Edge = std::array<std::int32_t, 2>;

constexpr double kLeastCornerAngle = 45;  // degrees by which a curve turns at a corner
constexpr double kCertain = 180;          // the angle of edges that are features in any case

[[nodiscard]] Edge sorted(std::int32_t a, std::int32_t b) {
  return a < b ? Edge{a, b} : Edge{b, a};
}

/// An edge as one triangle has it.
struct EdgeUse {
  Edge edge;
  std::int32_t triangle;
  bool forward;  // from the lower point to the higher
};

/// Union of sets of triangles.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  [[nodiscard]] std::int32_t find(std::int32_t i) {
    while (parent_[std::size_t(i)] != i) {
      i = parent_[std::size_t(i)] = parent_[std::size_t(parent_[std::size_t(i)])];
    }
    return i;
  }
  void unite(std::int32_t a, std::int32_t b) {
    a = find(a), b = find(b);
    parent_[std::size_t(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<std::int32_t> parent_;
};

class Finder {
 public:
  Finder(const SurfaceMesh& mesh, double feature_angle, std::span<const Edge> bends,
         SurfaceCounts& counts, Checkpoint& checkpoint)
      : mesh_(mesh),
        angle_(feature_angle),
        bends_(bends.begin(), bends.end()),
        counts_(counts),
        checkpoint_(checkpoint),
        sets_(mesh.triangles.size()) {}

  [[nodiscard]] SurfaceFeatures find() {
    collect_edges();
    find_normals();
    for_each_edge([&](std::span<const EdgeUse> uses) { classify(uses); });
    for (const Edge& edge : mesh_.edges) features_[sorted(edge[0], edge[1])] = kCertain;
    drop_inner_features();
    SurfaceFeatures result;
    number_patches(result);
    find_corners(result);
    walk_curves(result);
    counts_.patches = result.patch_count;
    counts_.curves = static_cast<std::int64_t>(result.curves.size());
    counts_.corners = static_cast<std::int64_t>(result.corners.size());
    return result;
  }

 private:
  [[nodiscard]] Vec3d point(std::int32_t i) const { return mesh_.points[std::size_t(i)]; }

  void collect_edges() {
    uses_.reserve(3 * mesh_.triangles.size());
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto& corners = mesh_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t a = corners[k], b = corners[(k + 1) % 3];
        uses_.push_back({sorted(a, b), static_cast<std::int32_t>(t), a < b});
      }
    }
    std::ranges::sort(uses_, [&](const EdgeUse& a, const EdgeUse& b) {
      checkpoint_();
      return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
    });
  }

  /// Calls `visit(uses)` for each edge.
  template <class Visit>
  void for_each_edge(const Visit& visit) const {
    for (auto first = uses_.begin(); first != uses_.end();) {
      const auto last = std::find_if(first, uses_.end(),
                                     [&](const EdgeUse& use) { return use.edge != first->edge; });
      checkpoint_();
      visit(std::span(first, last));
      first = last;
    }
  }

  /// Unit normals. A sliver without an area has that of the triangle across its longest edge.
  void find_normals() {
    normals_.resize(mesh_.triangles.size());
    for (std::size_t t = 0; t < normals_.size(); ++t) {
      const auto& c = mesh_.triangles[t];
      const Vec3d ab = point(c[1]) - point(c[0]), ac = point(c[2]) - point(c[0]);
      const Vec3d normal = cross(ab, ac);
      const double length = norm(normal);
      const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(ac - ab, ac - ab)});
      normals_[t] = length > 1e-10 * longest ? (1 / length) * normal : Vec3d{0, 0, 0};
      if (normals_[t] == Vec3d{0, 0, 0}) ++counts_.degenerate_triangles;
    }
    if (counts_.degenerate_triangles == 0) return;
    const std::vector<Vec3d> own = normals_;
    for (std::size_t t = 0; t < normals_.size(); ++t) {
      if (!(own[t] == Vec3d{0, 0, 0})) continue;
      const Edge longest = longest_edge(t);
      checkpoint_();
      int seen = 0;  // of many triangles at one edge any will do
      for (auto use = std::ranges::lower_bound(uses_, longest, {}, &EdgeUse::edge);
           use != uses_.end() && use->edge == longest && seen < 8; ++use, ++seen) {
        if (std::size_t(use->triangle) != t) normals_[t] = own[std::size_t(use->triangle)];
      }
    }
  }

  [[nodiscard]] Edge longest_edge(std::size_t t) const {
    const auto& c = mesh_.triangles[t];
    Edge longest{};
    double length = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double found = norm(point(c[k]) - point(c[(k + 1) % 3]));
      if (!(found > length)) continue;
      length = found;
      longest = sorted(c[k], c[(k + 1) % 3]);
    }
    return longest;
  }

  void classify(std::span<const EdgeUse> uses) {
    if (uses.size() != 2) {
      ++(uses.size() == 1 ? counts_.open_edges : counts_.non_manifold_edges);
      features_[uses[0].edge] = kCertain;
      return;
    }
    const auto a = std::size_t(uses[0].triangle), b = std::size_t(uses[1].triangle);
    const double side = uses[0].forward == uses[1].forward ? -1 : 1;  // turned over
    const double cosine = side * dot(normals_[a], normals_[b]);
    const bool known = !(normals_[a] == Vec3d{0, 0, 0}) && !(normals_[b] == Vec3d{0, 0, 0});
    if (!mesh_.patches.empty() && mesh_.patches[a] != mesh_.patches[b]) {
      features_[uses[0].edge] = kCertain;
    } else if (known && cosine < std::cos(angle_ * std::numbers::pi / 180) &&
               !bends_.contains(uses[0].edge)) {
      features_[uses[0].edge] = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
    }
  }

  /// Chains of creases that end inside a patch separate nothing: they are bends of a curved patch
  /// that its triangles happen to show. Those that are given stay.
  void drop_inner_features() {
    std::set<Edge> given;
    for (const Edge& edge : mesh_.edges) given.insert(sorted(edge[0], edge[1]));
    std::vector<int> degree(mesh_.points.size());
    std::vector<std::vector<Edge>> at(mesh_.points.size());
    for (const auto& [edge, angle] : features_) {
      for (const std::int32_t p : edge) {
        ++degree[std::size_t(p)];
        at[std::size_t(p)].push_back(edge);
      }
    }
    std::vector<std::int32_t> loose;
    for (std::size_t p = 0; p < degree.size(); ++p) {
      if (degree[p] == 1) loose.push_back(static_cast<std::int32_t>(p));
    }
    while (!loose.empty()) {
      const auto p = std::size_t(loose.back());
      loose.pop_back();
      for (const Edge& edge : at[p]) {
        if (given.contains(edge) || features_.erase(edge) == 0) continue;
        for (const std::int32_t end : edge) {
          if (--degree[std::size_t(end)] == 1) loose.push_back(end);
        }
      }
    }
  }

  void number_patches(SurfaceFeatures& result) {
    for_each_edge([&](std::span<const EdgeUse> uses) {
      if (features_.contains(uses[0].edge)) return;
      for (const EdgeUse& use : uses.subspan(1)) sets_.unite(uses[0].triangle, use.triangle);
    });
    std::vector<std::int32_t> number(mesh_.triangles.size(), -1);
    result.patch_of.resize(mesh_.triangles.size());
    for (std::size_t t = 0; t < number.size(); ++t) {
      std::int32_t& own = number[std::size_t(sets_.find(static_cast<std::int32_t>(t)))];
      if (own < 0) own = result.patch_count++;
      result.patch_of[t] = own;
    }
  }

  void find_corners(SurfaceFeatures& result) {
    neighbours_.resize(mesh_.points.size());
    for (const auto& [edge, angle] : features_) {
      neighbours_[std::size_t(edge[0])].push_back(edge[1]);
      neighbours_[std::size_t(edge[1])].push_back(edge[0]);
    }
    corner_number_.assign(mesh_.points.size(), -1);
    const double turn = std::cos(std::max(angle_, kLeastCornerAngle) * std::numbers::pi / 180);
    std::vector<std::uint8_t> given(mesh_.points.size());
    for (const std::int32_t p : mesh_.corners) given[std::size_t(p)] = 1;
    for (std::size_t p = 0; p < neighbours_.size(); ++p) {
      const auto& next = neighbours_[p];
      bool corner = given[p] != 0 || (!next.empty() && next.size() != 2);
      if (next.size() == 2) {
        const Vec3d a = mesh_.points[p] - point(next[0]), b = point(next[1]) - mesh_.points[p];
        corner = corner || dot(a, b) < turn * (norm(a) * norm(b));
      }
      if (!corner) continue;
      corner_number_[p] = static_cast<std::int32_t>(result.corners.size());
      result.corners.push_back(static_cast<std::int32_t>(p));
    }
  }

  void walk_curves(SurfaceFeatures& result) {
    std::set<Edge> open;
    for (const auto& [edge, angle] : features_) open.insert(edge);
    const auto walk = [&](std::int32_t first, std::int32_t second) {
      SurfaceCurve curve{{first, second}, {-1, -1}, 0};
      open.erase(sorted(first, second));
      while (corner_number_[std::size_t(curve.points.back())] < 0 && curve.points.back() != first) {
        const std::int32_t at = curve.points.back(), from = curve.points[curve.points.size() - 2];
        const auto& next = neighbours_[std::size_t(at)];
        curve.points.push_back(next[next[0] == from ? 1 : 0]);
        open.erase(sorted(at, curve.points.back()));
      }
      curve.ends[0] = corner_number_[std::size_t(first)];
      curve.ends[1] = corner_number_[std::size_t(curve.points.back())];
      for (std::size_t n = 1; n < curve.points.size(); ++n) {
        curve.angle += features_.at(sorted(curve.points[n - 1], curve.points[n]));
      }
      curve.angle /= static_cast<double>(curve.points.size() - 1);
      result.curves.push_back(std::move(curve));
    };
    for (const std::int32_t corner : result.corners) {
      for (const std::int32_t next : neighbours_[std::size_t(corner)]) {
        if (open.contains(sorted(corner, next))) walk(corner, next);
      }
    }
    while (!open.empty()) {
      const Edge edge = *open.begin();
      walk(edge[0], edge[1]);
    }
  }

  const SurfaceMesh& mesh_;
  double angle_;
  std::set<Edge> bends_;
  SurfaceCounts& counts_;
  Checkpoint& checkpoint_;
  std::vector<EdgeUse> uses_;
  std::vector<Vec3d> normals_;
  std::map<Edge, double> features_;                    // with their angles, in degrees
  std::vector<std::vector<std::int32_t>> neighbours_;  // along features
  std::vector<std::int32_t> corner_number_;            // by point; -1: none
  Sets sets_;
};

}  // namespace

SurfaceFeatures find_features(const SurfaceMesh& mesh, double feature_angle,
                              std::span<const std::array<std::int32_t, 2>> bends,
                              SurfaceCounts& counts, Checkpoint& checkpoint) {
  return Finder(mesh, feature_angle, bends, counts, checkpoint).find();
}

}  // namespace meshsmooth::detail

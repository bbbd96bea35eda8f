#include "surface/curve_paths.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "surface/node_tree.hpp"

namespace meshsmooth::detail {
namespace {

class PathFinder {
 public:
  PathFinder(const BoundaryMesh& boundary, const SurfaceTrees& surface,
             const std::function<void()>& check)
      : boundary_(boundary),
        surface_(surface),
        view_(surface.view()),
        check_(check),
        tree_(boundary, check),
        most_steps_(kStepsPerNode * boundary.node_count() +
                    kStepsPerCurve * surface.features().curves.size()) {
    const std::size_t n = boundary.node_count();
    in_own_path_.assign(n, 0);
    paths_.corner_of.assign(n, -1);
    paths_.curve_of.assign(n, -1);
    paths_.next.assign(n, {-1, -1});
    paths_.on_path.assign(boundary.edges().size(), 0);
    cost_.assign(n, 0);
    visit_.assign(n, 0);
    from_.assign(n, -1);
  }

  [[nodiscard]] CurvePaths find() {
    match_corners();
    const auto& curves = surface_.features().curves;
    std::vector<std::size_t> order(curves.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<double> lengths;
    for (const SurfaceCurve& curve : curves) lengths.push_back(length(curve));
    std::ranges::stable_sort(order, {}, [&](std::size_t c) { return lengths[c]; });
    for (const std::size_t c : order) {
      check_();
      if (match(static_cast<std::int32_t>(c), curves[c])) continue;
      ++paths_.unmatched_curves;
      if (curves[c].angle >= kSharp) continue;
      for (std::size_t n = 1; n < curves[c].points.size(); ++n) {
        const std::int32_t a = curves[c].points[n - 1], b = curves[c].points[n];
        paths_.bends.push_back({std::min(a, b), std::max(a, b)});
      }
    }
    return std::move(paths_);
  }

 private:
  static constexpr double kSharp = 60;  // degrees from which a crease is a feature in any case
  static constexpr std::size_t kChecked = 100;  // searches between two checks
  // Steps of Dijkstra's algorithm along edges. Paths near their curves take 8 to 15 for each of
  // their own, at most some hundred (HexOpt's CAD4, impeller, bunny), 1 to 10 for each node of the
  // boundary; one that does not exist would visit the whole boundary, for each of many curves.
  static constexpr std::size_t kStepsPerNode = 50, kStepsPerCurve = 500;  // all paths
  static constexpr std::size_t kStepsPerEdge = 100, kLeastSteps = 4000;   // of one path

  [[nodiscard]] Vec3d node(std::int32_t n) const { return boundary_.points()[std::size_t(n)]; }
  [[nodiscard]] Vec3d point(std::int32_t p) const { return surface_.points()[std::size_t(p)]; }
  [[nodiscard]] double length(const SurfaceCurve& curve) const {
    double sum = 0;
    for (std::size_t n = 1; n < curve.points.size(); ++n) {
      sum += norm(point(curve.points[n]) - point(curve.points[n - 1]));
    }
    return sum;
  }

  /// Greedy, by the mismatch of each corner with its likeliest nodes.
  void match_corners() {
    constexpr std::size_t kCandidates = 8;
    const auto& corners = surface_.features().corners;
    struct Pair {
      double mismatch;
      std::int32_t corner, node;
    };
    std::vector<Pair> pairs;
    for (std::size_t c = 0; c < corners.size(); ++c) {
      if (c % kChecked == 0) check_();
      for (const Match& match : tree_.likeliest(point(corners[c]), true, kCandidates,
                                                [](std::int32_t) { return true; })) {
        pairs.push_back({match.mismatch, static_cast<std::int32_t>(c), match.node});
      }
    }
    std::ranges::sort(pairs, {}, [](const Pair& pair) {
      return std::tuple(pair.mismatch, pair.corner, pair.node);
    });
    node_of_corner_.assign(corners.size(), -1);
    for (const Pair& pair : pairs) {
      std::int32_t& of_corner = node_of_corner_[std::size_t(pair.corner)];
      std::int32_t& of_node = paths_.corner_of[std::size_t(pair.node)];
      if (of_corner >= 0 || of_node >= 0) continue;
      of_corner = pair.node;
      of_node = pair.corner;
    }
    paths_.unmatched_corners = std::ranges::count(node_of_corner_, -1);
  }

  /// Nodes along edges, one more than these.
  struct Path {
    std::vector<std::int32_t> nodes, edges;
  };

  bool match(std::int32_t curve, const SurfaceCurve& shape) {
    std::vector<std::int32_t> stops;
    if (shape.ends[0] >= 0 && shape.ends[0] != shape.ends[1]) {
      for (const std::int32_t end : shape.ends) {
        stops.push_back(node_of_corner_[std::size_t(end)]);
      }
    } else {
      stops = stops_of_loop(shape);
    }
    if (stops.size() < 2 || std::ranges::count(stops, -1) > 0) return false;
    Path path{{stops[0]}, {}};
    in_own_path_[std::size_t(stops[0])] = 1;
    const double curve_length = length(shape);
    bool whole = true;
    for (std::size_t n = 0; n + 1 < stops.size() && whole; ++n) {
      whole = append_path(curve, curve_length, stops[n + 1], stops, path);
    }
    for (const std::int32_t n : path.nodes) in_own_path_[std::size_t(n)] = 0;
    if (!whole || !follows(path.nodes, curve, shape.angle < kSharp)) return false;
    take(curve, path);
    return true;
  }

  /// Whether no node of the path is much farther from the curve than from the surface.
  [[nodiscard]] bool follows(const std::vector<std::int32_t>& path, std::int32_t curve,
                             bool bend) const {
    const double most = bend ? 0.25 : 1.0;  // of the edges there
    std::size_t measured = 0;
    return std::ranges::all_of(path, [&](std::int32_t n) {
      if (++measured % kChecked == 0) check_();
      const double off =
          std::sqrt(closest_in_tree(view_, view_.all_patches(), node(n)).closest.squared);
      return distance(curve, node(n)) <= 1.5 * off + most * boundary_.size_at(n);
    });
  }

  /// The nodes nearest to three points of a loop: a path has no other way then.
  [[nodiscard]] std::vector<std::int32_t> stops_of_loop(const SurfaceCurve& shape) const {
    std::vector<std::int32_t> stops;
    const bool at_corner = shape.ends[0] >= 0;
    if (at_corner) stops.push_back(node_of_corner_[std::size_t(shape.ends[0])]);
    const double whole = length(shape);
    double reached = 0;
    for (std::size_t n = 0; n + 1 < shape.points.size() && stops.size() < 3; ++n) {
      if (reached >= whole * static_cast<double>(stops.size()) / 3) {
        stops.push_back(nearest_free(point(shape.points[n]), stops));
      }
      reached += norm(point(shape.points[n + 1]) - point(shape.points[n]));
    }
    if (stops.size() < 3) return {};
    stops.push_back(stops.front());
    return stops;
  }

  [[nodiscard]] bool is_free(std::int32_t n) const {
    return paths_.corner_of[std::size_t(n)] < 0 && paths_.curve_of[std::size_t(n)] < 0;
  }

  [[nodiscard]] std::int32_t nearest_free(Vec3d at, const std::vector<std::int32_t>& not_of) const {
    const auto found = tree_.likeliest(at, false, 1, [&](std::int32_t n) {
      return is_free(n) && std::ranges::count(not_of, n) == 0;
    });
    return found.empty() ? -1 : found.front().node;
  }

  /// The cheaper an edge, the nearer it is to the curve; creases are cheaper than others.
  [[nodiscard]] double cost(std::int32_t curve, std::int32_t edge, double distance_at_end) const {
    constexpr double kOnCurve = 0.01, kCrease = 0.25;
    const BoundaryEdge& e = boundary_.edges()[std::size_t(edge)];
    const Vec3d middle = 0.5 * (node(e.nodes[0]) + node(e.nodes[1]));
    const double off =
        0.5 * (distance(curve, middle) + distance_at_end) / std::max(e.length, 1e-300);
    return e.length * (off * off + kOnCurve) * (e.crease ? kCrease : 1);
  }
  [[nodiscard]] double distance(std::int32_t curve, Vec3d p) const {
    return std::sqrt(closest_in_tree(view_, view_.patch_count + curve, p).closest.squared);
  }

  /// How many steps a path from there along the curve may take.
  [[nodiscard]] std::size_t steps_from(std::int32_t start, double curve_length) const {
    const double edges = curve_length / std::max(boundary_.size_at(start), 1e-300);
    const double most = std::min(kStepsPerEdge * edges, static_cast<double>(most_steps_));
    return std::min(most_steps_, kLeastSteps + static_cast<std::size_t>(most));
  }

  /// Dijkstra's algorithm from the end of the path, not through other stops.
  bool append_path(std::int32_t curve, double curve_length, std::int32_t to,
                   const std::vector<std::int32_t>& stops, Path& path) {
    using Entry = std::pair<double, std::int32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const std::int32_t start = path.nodes.back();
    const std::size_t most = steps_from(start, curve_length);
    std::size_t steps = 0;
    ++round_;
    const auto reach = [&](std::int32_t n, double at_cost, std::int32_t edge) {
      const auto id = std::size_t(n);
      if (visit_[id] == round_ && cost_[id] <= at_cost) return;
      visit_[id] = round_;
      cost_[id] = at_cost;
      from_[id] = edge;
      queue.push({at_cost, n});
    };
    reach(start, 0, -1);
    while (!queue.empty() && steps < most) {
      const auto [at_cost, at] = queue.top();
      queue.pop();
      if (at == to) break;
      if (at_cost > cost_[std::size_t(at)]) continue;
      for (const std::int32_t e : boundary_.edges_at(at)) {
        if (++steps % kChecked == 0) check_();
        if (steps > most) break;
        if (paths_.on_path[std::size_t(e)] != 0) continue;
        const std::int32_t n = boundary_.other_end(e, at);
        const bool inside =
            is_free(n) && std::ranges::count(stops, n) == 0 && in_own_path_[std::size_t(n)] == 0;
        if (n != to && !inside) continue;
        reach(n, at_cost + cost(curve, e, distance(curve, node(n))), e);
      }
    }
    most_steps_ -= std::min(steps, most_steps_);
    if (visit_[std::size_t(to)] != round_ || from_[std::size_t(to)] < 0) return false;
    const std::size_t old = path.nodes.size();
    for (std::int32_t n = to; n != start; n = boundary_.other_end(path.edges.back(), n)) {
      path.nodes.push_back(n);
      path.edges.push_back(from_[std::size_t(n)]);
      in_own_path_[std::size_t(n)] = 1;
    }
    std::reverse(path.nodes.begin() + static_cast<std::ptrdiff_t>(old), path.nodes.end());
    std::reverse(path.edges.begin() + static_cast<std::ptrdiff_t>(old - 1), path.edges.end());
    return true;
  }

  void take(std::int32_t curve, const Path& path) {
    const std::vector<std::int32_t>& nodes = path.nodes;
    const bool closed = nodes.front() == nodes.back();
    for (const std::int32_t e : path.edges) paths_.on_path[std::size_t(e)] = 1;
    for (std::size_t n = 0; n + 1 < nodes.size(); ++n) {
      const auto id = std::size_t(nodes[n]);
      if (paths_.corner_of[id] >= 0 || (n == 0 && !closed)) continue;
      paths_.curve_of[id] = curve;
      paths_.next[id] = {n == 0 ? nodes[nodes.size() - 2] : nodes[n - 1], nodes[n + 1]};
    }
  }

  const BoundaryMesh& boundary_;
  const SurfaceTrees& surface_;
  SurfaceView view_;
  const std::function<void()>& check_;
  CurvePaths paths_;
  NodeTree tree_;
  std::size_t most_steps_;                 // that are left
  std::vector<std::uint8_t> in_own_path_;  // by node: in the path that is being found
  std::vector<std::int32_t> node_of_corner_;
  std::vector<double> cost_;  // by node, in the round in which it was visited
  std::vector<int> visit_;
  std::vector<std::int32_t> from_;  // the edge by which it was reached
  int round_ = 0;
};

}  // namespace

CurvePaths find_curve_paths(const BoundaryMesh& boundary, const SurfaceTrees& surface,
                            const std::function<void()>& check) {
  return PathFinder(boundary, surface, check).find();
}

}  // namespace meshsmooth::detail

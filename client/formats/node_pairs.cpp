#include "node_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <sstream>
#include <variant>

#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

constexpr double kTolerance = 1e-5;

/// x' = rotation * (x - from) + to, the rotation by its rows.
struct Motion {
  std::array<Vec3d, 3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3d from{}, to{};

  [[nodiscard]] Vec3d turned(const Vec3d& v) const {
    return {dot(rotation[0], v), dot(rotation[1], v), dot(rotation[2], v)};
  }
  [[nodiscard]] Vec3d operator()(const Vec3d& x) const { return turned(x - from) + to; }
};

struct Points {
  std::vector<Vec3d> of_a, of_b;
  Vec3d centre_a{}, centre_b{};
  double tolerance = 0;
};

Vec3d centre_of(const std::vector<Vec3d>& points) {
  Vec3d sum{};
  for (const Vec3d& p : points) sum += p;
  return 1.0 / static_cast<double>(points.size()) * sum;
}

double diagonal_of(const std::vector<Vec3d>& points) {
  Vec3d low = points.front(), high = low;
  for (const Vec3d& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return norm(high - low);
}

/// Points by their coordinate along the longest axis of their box.
class Finder {
 public:
  explicit Finder(const std::vector<Vec3d>& points) : points_(points), order_(points.size()) {
    Vec3d low = points.front(), high = low;
    for (const Vec3d& p : points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Vec3d size = high - low;
    if (size.y > size.x) axis_ = &Vec3d::y;
    if (size.z > std::max(size.x, size.y)) axis_ = &Vec3d::z;
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::sort(order_, {}, [&](std::size_t i) { return points_[i].*axis_; });
  }

  struct Found {
    std::size_t point = 0;
    double distance = std::numeric_limits<double>::infinity();
  };

  /// The nearest point that is nearer than `limit`, if there is one.
  [[nodiscard]] Found nearest(const Vec3d& to, double limit) const {
    Found best{0, limit};
    bool any = false;
    const auto look = [&](std::size_t i) {
      if (std::abs(points_[i].*axis_ - to.*axis_) > best.distance) return false;
      const double distance = norm(points_[i] - to);
      if (distance <= best.distance) {
        best = {i, distance};
        any = true;
      }
      return true;
    };
    const auto middle = std::ranges::lower_bound(order_, to.*axis_, {},
                                                 [&](std::size_t i) { return points_[i].*axis_; });
    for (auto i = middle; i != order_.end() && look(*i);) ++i;
    for (auto i = middle; i != order_.begin() && look(*(i - 1));) --i;
    return any ? best : Found{};
  }

 private:
  const std::vector<Vec3d>& points_;
  std::vector<std::size_t> order_;
  double Vec3d::*axis_ = &Vec3d::x;
};

/// By the points of a, their partners among those of b; nothing where one has none.
std::optional<std::vector<std::size_t>> match(const Points& points, const Finder& finder,
                                              const Motion& motion) {
  std::vector<std::size_t> partners;
  std::vector<bool> taken(points.of_b.size());
  for (const Vec3d& p : points.of_a) {
    const auto found = finder.nearest(motion(p), points.tolerance);
    if (found.distance > points.tolerance || taken[found.point]) return std::nullopt;
    taken[found.point] = true;
    partners.push_back(found.point);
  }
  return partners;
}

/// Two directions from the centre of a's points that fix a rotation: to the farthest point, and to
/// that farthest from the line through it.
struct Frame {
  Vec3d first{}, second{};
  bool on_a_line = false;
};

Frame frame_of(const Points& points) {
  Frame frame;
  for (const Vec3d& p : points.of_a) {
    if (norm(p - points.centre_a) > norm(frame.first)) frame.first = p - points.centre_a;
  }
  double farthest = 0;
  for (const Vec3d& p : points.of_a) {
    const Vec3d v = p - points.centre_a;
    const double distance = norm(cross(v, frame.first)) / norm(frame.first);
    if (distance <= farthest) continue;
    farthest = distance;
    frame.second = v;
  }
  frame.on_a_line = !(farthest > 10 * points.tolerance);
  return frame;
}

/// An orthonormal basis whose first vector is along `first`, the second in the plane of both.
std::array<Vec3d, 3> basis_of(const Vec3d& first, const Vec3d& second) {
  const Vec3d u = (1 / norm(first)) * first;
  const Vec3d across = second - dot(u, second) * u;
  const Vec3d v = (1 / norm(across)) * across;
  return {u, v, cross(u, v)};
}

/// The rotation that takes one basis to another.
std::array<Vec3d, 3> rotation_between(const std::array<Vec3d, 3>& from,
                                      const std::array<Vec3d, 3>& to) {
  std::array<Vec3d, 3> rows{};
  for (std::size_t k = 0; k < 3; ++k) {
    rows[0] += to[k].x * from[k];
    rows[1] += to[k].y * from[k];
    rows[2] += to[k].z * from[k];
  }
  return rows;
}

/// A vector that is not along `v`.
Vec3d any_other(const Vec3d& v) {
  const bool along_x = std::abs(v.x) > std::abs(v.y) && std::abs(v.x) > std::abs(v.z);
  return along_x ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
}

/// The rotation of two directions of a to two of b, as a motion of the centres.
void add_candidate(const Points& points, const std::array<Vec3d, 3>& from,
                   const std::array<Vec3d, 3>& to, std::vector<Motion>& motions) {
  motions.push_back({rotation_between(from, to), points.centre_a, points.centre_b});
}

/// The rotations that take the frame of a to points of b. A side on a line does not fix its
/// rotation about itself; the least one is taken.
std::vector<Motion> find_rotations(const Points& points) {
  constexpr std::size_t kMost = 20000;  // of a sphere all nodes are as far from the centre
  const Frame frame = frame_of(points);
  const double near = 4 * points.tolerance;
  const double first_length = norm(frame.first);
  std::vector<Motion> motions;
  std::vector<Vec3d> ends;  // as far from the centre as the second direction of the frame
  for (const Vec3d& p : points.of_b) {
    const double length = norm(p - points.centre_b);
    if (std::abs(length - norm(frame.second)) <= near) ends.push_back(p - points.centre_b);
  }
  for (const Vec3d& p : points.of_b) {
    const Vec3d first = p - points.centre_b;
    if (std::abs(norm(first) - first_length) > near) continue;
    if (frame.on_a_line) {
      const Vec3d normal = cross(frame.first, first);
      const bool along = !(norm(normal) > near * first_length);
      const Vec3d axis = along ? cross(first, any_other(first)) : normal;
      add_candidate(points, basis_of(frame.first, axis), basis_of(first, axis), motions);
      continue;
    }
    for (const Vec3d& second : ends) {
      if (std::abs(norm(second - first) - norm(frame.second - frame.first)) > near) continue;
      if (motions.size() >= kMost) return motions;
      add_candidate(points, basis_of(frame.first, frame.second), basis_of(first, second), motions);
    }
  }
  return motions;
}

/// What is tried first: no part along the axis, then the smaller angle.
std::array<double, 2> order_of(const Motion& motion, double tolerance) {
  const auto& r = motion.rotation;
  const double cosine = std::clamp((r[0].x + r[1].y + r[2].z - 1) / 2, -1.0, 1.0);
  // Twice the sine times the axis. At half a turn it vanishes, and the axis stands in R + 1.
  Vec3d axis{r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y};
  if (norm(axis) < 1e-6) {
    const std::array<Vec3d, 3> rows{
        {r[0] + Vec3d{1, 0, 0}, r[1] + Vec3d{0, 1, 0}, r[2] + Vec3d{0, 0, 1}}};
    axis = *std::ranges::max_element(rows, {}, [](const Vec3d& row) { return norm(row); });
  }
  const double along = std::abs(dot(axis, motion.to - motion.from)) / std::max(norm(axis), 1e-300);
  return {along > 10 * tolerance ? along : 0, std::acos(cosine)};
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value;
  return text.str();
}

[[noreturn]] void refuse(const std::string& what, const std::string& field) {
  throw InvalidOption("PERIODIC_MISMATCH", what, {{"field", field}});
}

[[noreturn]] void refuse_unmatched(const Points& points, const Finder& finder, const Side& a,
                                   const Side& b, const std::string& field) {
  const Motion translation{.from = points.centre_a, .to = points.centre_b};
  std::size_t worst = 0;
  double distance = -1;
  for (std::size_t i = 0; i < points.of_a.size(); ++i) {
    const auto found =
        finder.nearest(translation(points.of_a[i]), std::numeric_limits<double>::infinity());
    if (found.distance <= distance) continue;
    distance = found.distance;
    worst = i;
  }
  refuse("no translation or rotation takes \"" + a.name + "\" to \"" + b.name +
             "\": translated, node " + std::to_string(a.nodes[worst]) + " is " + number(distance) +
             " away from the nearest node there, the tolerance is " + number(points.tolerance) +
             "; the two sides need the same nodes",
         field);
}

}  // namespace

std::vector<NodePair> match_sides(const PositionsView& positions, const Side& a, const Side& b,
                                  const std::string& field) {
  if (a.nodes.size() != b.nodes.size() || a.nodes.empty()) {
    refuse("\"" + a.name + "\" has " + std::to_string(a.nodes.size()) + " nodes, \"" + b.name +
               "\" has " + std::to_string(b.nodes.size()) +
               "; periodic sides need the same number, at least 1",
           field);
  }
  Points points;
  std::visit(
      [&](const auto& all) {
        for (const NodeId node : a.nodes) {
          points.of_a.push_back(vec3_cast<double>(all[static_cast<std::size_t>(node)]));
        }
        for (const NodeId node : b.nodes) {
          points.of_b.push_back(vec3_cast<double>(all[static_cast<std::size_t>(node)]));
        }
      },
      positions);
  points.centre_a = centre_of(points.of_a);
  points.centre_b = centre_of(points.of_b);
  points.tolerance = kTolerance * std::max(diagonal_of(points.of_a), diagonal_of(points.of_b));
  const Finder finder(points.of_b);
  auto partners = match(points, finder, {.from = points.centre_a, .to = points.centre_b});
  if (!partners) {
    std::vector<Motion> motions = find_rotations(points);
    std::ranges::stable_sort(
        motions, {}, [&](const Motion& motion) { return order_of(motion, points.tolerance); });
    for (auto motion = motions.begin(); motion != motions.end() && !partners; ++motion) {
      partners = match(points, finder, *motion);
    }
  }
  if (!partners) refuse_unmatched(points, finder, a, b, field);
  std::vector<NodePair> pairs;
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    pairs.push_back({a.nodes[i], b.nodes[(*partners)[i]]});
  }
  return pairs;
}

}  // namespace meshsmooth::formats

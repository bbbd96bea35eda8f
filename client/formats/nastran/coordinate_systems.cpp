#include "nastran/coordinate_systems.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace meshsmooth::formats {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// Exact at multiples of 90 degrees.
double cosine(double degrees) {
  const double angle = std::abs(std::remainder(degrees, 360));
  if (angle == 90) return 0;
  return std::cos(angle / kDegrees);
}

double sine(double degrees) { return cosine(degrees - 90); }

/// The angle's branch next to `before`.
double nearest_branch(double angle, double before) {
  return before + std::remainder(angle - before, 360);
}

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double product(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

double length_of(const Vec3d& v) { return std::hypot(v.x, v.y, v.z); }

/// A coordinate that has changed by no more than rounding stays.
double settled(double now, double before, double size) {
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  return std::abs(now - before) <= kRounding * size ? before : now;
}

/// None: the points are in a line.
std::optional<CoordinateFrame> make_frame(CoordinateFrame::Kind kind,
                                          const std::array<Vec3d, 3>& points) {
  const Vec3d along = points[1] - points[0];
  const Vec3d across = points[2] - points[0];
  const double length = length_of(along);
  const Vec3d normal = cross(along, across);
  const double area = length_of(normal);
  constexpr double kLeast = 1e-12;
  if (!(length > 0) || !(area > kLeast * length * length_of(across))) return std::nullopt;
  const Vec3d z = (1 / length) * along;
  const Vec3d y = (1 / area) * normal;
  return CoordinateFrame{kind, points[0], {cross(y, z), y, z}};
}

/// The frames of systems as they are asked for.
class Frames {
 public:
  using Failed = CoordinateSystems::Failed;
  using PositionOf = std::function<Vec3d(NodeId)>;

  Frames(const CoordinateSystems& all, Failed failed)
      : all_(all), frames_(all.systems.size()), failed_(std::move(failed)) {}

  /// By default from what was read.
  void take_positions(PositionOf position_of) { position_of_ = std::move(position_of); }

  const CoordinateFrame& of(std::int32_t system) {
    static const CoordinateFrame basic;
    if (system == CoordinateSystems::kBasic) return basic;
    auto& frame = frames_[static_cast<std::size_t>(system)];
    if (!frame) frame = make(static_cast<std::size_t>(system));
    return *frame;
  }
  Vec3d position(NodeId node) {
    if (position_of_) return position_of_(node);
    const auto place = static_cast<std::size_t>(node);
    return of(all_.of_node[place]).to_basic(all_.local[place]);
  }

 private:
  CoordinateFrame make(std::size_t place) {
    constexpr int kMostNested = 200;
    const CoordinateSystems::System& system = all_.systems[place];
    if (nested_ == kMostNested) failed_(place, "is defined by itself, or by too many others");
    if (!system.is_complete) failed_(place, "refers to a system or a GRID that is not in the deck");
    ++nested_;
    std::array<Vec3d, 3> points{};
    for (std::size_t point = 0; point < points.size(); ++point) {
      points[point] = system.definition.by_nodes
                          ? position(system.nodes[point])
                          : of(system.reference).to_basic(system.definition.points[point]);
    }
    --nested_;
    const auto frame = make_frame(system.definition.kind, points);
    if (!frame) failed_(place, "is defined by three points in a line");
    return frame.value_or(CoordinateFrame());
  }

  const CoordinateSystems& all_;
  std::vector<std::optional<CoordinateFrame>> frames_;
  Failed failed_;
  PositionOf position_of_;
  int nested_ = 0;
};

}  // namespace

Vec3d CoordinateFrame::to_basic(const Vec3d& local) const {
  Vec3d p = local;
  if (kind == Kind::cylindrical) {
    p = {local.x * cosine(local.y), local.x * sine(local.y), local.z};
  } else if (kind == Kind::spherical) {
    const double radius = local.x * sine(local.y);
    p = {radius * cosine(local.z), radius * sine(local.z), local.x * cosine(local.y)};
  }
  return origin + p.x * axes[0] + p.y * axes[1] + p.z * axes[2];
}

Vec3d CoordinateFrame::to_local(const Vec3d& basic, const Vec3d& before) const {
  const Vec3d from = basic - origin;
  const Vec3d p = {product(from, axes[0]), product(from, axes[1]), product(from, axes[2])};
  const double size = std::max(length_of(basic), length_of(origin));
  if (kind == Kind::rectangular) {
    return {settled(p.x, before.x, size), settled(p.y, before.y, size),
            settled(p.z, before.z, size)};
  }
  const double sign = before.x < 0 ? -1 : 1;
  const double radius = std::hypot(p.x, p.y);
  const auto angle = [](double y, double x, double otherwise) {
    const double now = nearest_branch(std::atan2(y, x) * kDegrees, otherwise);
    return settled(now, otherwise, 180 + std::abs(otherwise));
  };
  if (kind == Kind::cylindrical) {
    const double theta = radius == 0 ? before.y : angle(sign * p.y, sign * p.x, before.y);
    return {settled(sign * radius, before.x, size), theta, settled(p.z, before.z, size)};
  }
  const double all = length_of(p);
  if (all == 0) return {0, before.y, before.z};
  // The same point has two pairs of angles: on this side of the z axis, and on the other.
  std::array<Vec3d, 2> candidates{};
  for (std::size_t side = 0; side < candidates.size(); ++side) {
    const double turned = side == 0 ? sign : -sign;
    candidates[side] = {settled(sign * all, before.x, size),
                        angle(side == 0 ? radius : -radius, sign * p.z, before.y),
                        radius == 0 ? before.z : angle(turned * p.y, turned * p.x, before.z)};
  }
  const auto turn = [&](const Vec3d& to) {
    return std::abs(to.y - before.y) + std::abs(to.z - before.z);
  };
  return turn(candidates[0]) <= turn(candidates[1]) ? candidates[0] : candidates[1];
}

std::vector<Vec3d> CoordinateSystems::basic_positions(const Failed& failed) const {
  Frames frames(*this, failed);
  std::vector<Vec3d> positions = local;
  for (std::size_t node = 0; node < local.size(); ++node) {
    if (of_node[node] != kBasic) positions[node] = frames.of(of_node[node]).to_basic(local[node]);
  }
  return positions;
}

std::vector<Vec3d> CoordinateSystems::local_positions(std::span<const Vec3d> read,
                                                      std::span<const Vec3d> now,
                                                      const Failed& failed) const {
  Frames before(*this, failed);
  Frames after(*this, failed);
  after.take_positions([&](NodeId node) { return now[static_cast<std::size_t>(node)]; });
  std::vector<Vec3d> positions(now.begin(), now.end());
  for (std::size_t node = 0; node < local.size(); ++node) {
    if (of_node[node] == kBasic) continue;
    const CoordinateFrame& frame = after.of(of_node[node]);
    const bool stays = now[node] == read[node] && frame == before.of(of_node[node]);
    positions[node] = stays ? local[node] : frame.to_local(now[node], local[node]);
  }
  return positions;
}

}  // namespace meshsmooth::formats

#include <gmsh.h>

#include <array>
#include <cmath>

#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/gmsh_model.hpp"
#include "generate/rotation.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

// Turek and Hron 2006, in metres.
constexpr double kLength = 2.5;
constexpr double kHeight = 0.41;
constexpr Vec3d kCentre = {0.2, 0.2, 0};
constexpr double kRadius = 0.05;
constexpr double kFlapLength = 0.35;
constexpr double kFlapHeight = 0.02;
constexpr double kRoot = kCentre.x + kRadius;  // where the flap begins to curve
constexpr double kTip = kRoot + kFlapLength;
constexpr double kHalf = 0.5 * kFlapHeight;

/// Rise of the tip's centre when the flap is an arc that turns by `angle`. Grows up to an angle
/// of 2.33.
double rise(double angle) { return angle == 0 ? 0 : kFlapLength * (1 - std::cos(angle)) / angle; }

/// The angle whose tip rises by this share of the free height above or below the flap.
double angle_of(double share) {
  const double top = kHeight - (kCentre.y + kHalf);
  const double bottom = kCentre.y - kHalf;
  const double wanted = std::abs(share) * (share > 0 ? top : bottom);
  double lower = 0;
  double upper = 2.33;
  constexpr int kHalvings = 60;
  for (int step = 0; step < kHalvings; ++step) {
    const double middle = 0.5 * (lower + upper);
    (rise(middle) < wanted ? lower : upper) = middle;
  }
  return share < 0 ? -lower : lower;
}

/// Where a point of the straight flap is when its centre line is an arc.
Vec3d curve(Vec3d point, double angle) {
  const double along = point.x - kRoot;
  if (angle == 0 || along <= 0) return point;
  const double radius = kFlapLength / angle;
  const double turned = along / radius;
  const double arm = radius - (point.y - kCentre.y);  // to the centre of the arc
  return {kRoot + arm * std::sin(turned), kCentre.y + radius - arm * std::cos(turned), 0};
}

/// Curves of the channel's geometry.
struct Channel {
  std::array<int, 4> cylinder{};
  std::array<int, 3> flap{};
};

Channel build_channel(double size) {
  namespace geo = gmsh::model::geo;
  const double far = 5 * size;
  const auto point = [](double x, double y, double at) { return geo::addPoint(x, y, 0, at); };
  const std::array<int, 4> walls = {point(0, 0, far), point(kLength, 0, far),
                                    point(kLength, kHeight, far), point(0, kHeight, far)};
  const double root = kCentre.x + std::sqrt(kRadius * kRadius - kHalf * kHalf);
  const int centre = point(kCentre.x, kCentre.y, size);
  const std::array<int, 5> around = {
      point(root, kCentre.y + kHalf, size), point(kCentre.x, kCentre.y + kRadius, size),
      point(kCentre.x - kRadius, kCentre.y, size), point(kCentre.x, kCentre.y - kRadius, size),
      point(root, kCentre.y - kHalf, size)};
  const int lower_tip = point(kTip, kCentre.y - kHalf, size);
  const int upper_tip = point(kTip, kCentre.y + kHalf, size);

  std::vector<int> outer;
  for (std::size_t side = 0; side < 4; ++side) {
    outer.push_back(geo::addLine(walls[side], walls[(side + 1) % 4]));
  }
  Channel channel;
  for (std::size_t arc = 0; arc < 4; ++arc) {
    channel.cylinder[arc] = geo::addCircleArc(around[arc], centre, around[arc + 1]);
  }
  channel.flap = {geo::addLine(around[4], lower_tip), geo::addLine(lower_tip, upper_tip),
                  geo::addLine(upper_tip, around[0])};
  std::vector<int> hole(channel.cylinder.begin(), channel.cylinder.end());
  hole.insert(hole.end(), channel.flap.begin(), channel.flap.end());
  geo::addPlaneSurface({geo::addCurveLoop(outer), geo::addCurveLoop(hole)});
  geo::synchronize();
  return channel;
}

double checked_angle(const FlapOptions& options) {
  check_option("tip", options.tip, -0.95, 0.95);
  if (options.tip != 0 && options.degrees != 0) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "tip and degrees: choose one",
                        {{"field", "tip, degrees"}});
  }
  if (options.tip != 0) return angle_of(options.tip);
  // Beyond, the tip would touch the wall.
  const double most = std::floor(angle_of(0.95) * 180 / std::numbers::pi);
  check_option("degrees", options.degrees, -most, most);
  return radians(options.degrees);
}

}  // namespace

MeshFile generate_flap(const FlapOptions& options) {
  check_option("size", options.size, 2e-4, 0.02);
  const double angle = checked_angle(options);
  std::vector<std::uint8_t> fixed;
  Channel channel;
  Mesh mesh = make_with_gmsh(
      "flap", 2, [&] { channel = build_channel(options.size); },
      [&](GmshMesh& made) {
        auto& nodes = std::get<std::vector<Vec3d>>(made.mesh.positions);
        fixed.assign(nodes.size(), 0);
        const auto fix = [&](int curve) {
          for_each_node_of(made, 1, curve, [&](std::size_t node) { fixed[node] = 1; });
        };
        for (const int arc : channel.cylinder) fix(arc);
        std::vector<std::uint8_t> on_flap(nodes.size());
        for (const int line : channel.flap) {
          fix(line);
          for_each_node_of(made, 1, line, [&](std::size_t node) { on_flap[node] = 1; });
        }
        for (std::size_t node = 0; node < nodes.size(); ++node) {
          if (on_flap[node] != 0) nodes[node] = curve(nodes[node], angle);
        }
      });
  return make_case_file(std::move(mesh), fixed);
}

}  // namespace meshsmooth::formats

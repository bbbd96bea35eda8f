#pragma once

// Meshes with a motion of their boundary, for the method Move.

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "generate/cases.hpp"
#include "meshsmooth/options.hpp"
#include "support/meshes.hpp"

namespace meshsmooth::test {

/// A reference and where its boundary shall lie.
struct Motion {
  std::string name;
  Mesh reference;
  std::vector<NodeId> nodes;
  std::vector<Vec3d> positions;

  [[nodiscard]] SmoothOptions options(Move method = {}) const {
    SmoothOptions options;
    options.method = method;
    return options;
  }
  [[nodiscard]] JobInput input() const {
    return {.prescribed = {nodes, std::span<const Vec3d>(positions)}};
  }
};

/// The whole boundary, by a map.
inline Motion boundary_motion(std::string name, Mesh reference,
                              const std::function<Vec3d(Vec3d)>& map) {
  Motion motion{std::move(name), std::move(reference), {}, {}};
  motion.nodes = find_boundary_nodes(MeshTopology(motion.reference).view());
  for (const NodeId node : motion.nodes) {
    motion.positions.push_back(map(points(motion.reference)[static_cast<std::size_t>(node)]));
  }
  return motion;
}

inline Vec3d turned(Vec3d p, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {p.x * std::cos(angle) - p.y * std::sin(angle),
          p.x * std::sin(angle) + p.y * std::cos(angle), p.z};
}

/// The inner circle or cylinder of an annulus turns; its ends, if it has any, shear.
inline Motion turned_hub(int rows, double degrees, int layers = 0) {
  return boundary_motion(
      "hub of " + std::to_string(rows) + " rows by " + std::to_string(int(degrees)) + " degrees",
      formats::generate_hub({.rows = rows, .degrees = 0, .layers = layers}).mesh,
      [=](Vec3d p) { return turned(p, degrees * (1 - std::hypot(p.x, p.y)) / 0.6); });
}

/// The same of an extruded one, whose cylinders alone are prescribed: its ends may slide.
inline Motion turned_cylinders(int rows, double degrees, int layers) {
  const Motion whole = turned_hub(rows, degrees, layers);
  Motion cylinders{whole.name, whole.reference, {}, {}};
  for (std::size_t n = 0; n < whole.nodes.size(); ++n) {
    const Vec3d p = points(whole.reference)[static_cast<std::size_t>(whole.nodes[n])];
    const double radius = std::hypot(p.x, p.y);
    if (radius > 0.401 && radius < 0.999) continue;
    cylinders.nodes.push_back(whole.nodes[n]);
    cylinders.positions.push_back(whole.positions[n]);
  }
  return cylinders;
}

/// A thin ellipse that turns in a disc, in layers that grow by e^4 from it.
inline Motion pitched_foil() {
  constexpr double kGrowth = 4;
  Mesh reference = mapped(formats::generate_hub({.rows = 16, .degrees = 0}).mesh, [](Vec3d p) {
    const double radius = std::hypot(p.x, p.y);
    const double share = std::expm1(kGrowth * (radius - 0.4) / 0.6) / std::expm1(kGrowth);
    return Vec3d{(0.5 + 1.5 * share) * p.x / radius, (0.05 + 1.95 * share) * p.y / radius, 0};
  });
  return boundary_motion("pitched foil", std::move(reference),
                         [](Vec3d p) { return std::hypot(p.x, p.y) < 1 ? turned(p, 60) : p; });
}

/// The unit cube or square of a lattice, jittered.
inline Mesh unit_lattice(ElementType type, int cells) {
  return mapped(noisy(lattice(type, cells), 0.15, 5), [=](Vec3d p) { return (1.0 / cells) * p; });
}

/// Twisted about an upright axis; a square about its centre, by nothing at its boundary's middle.
inline Motion twisted(const std::string& name, Mesh reference, double degrees) {
  return boundary_motion(name + " twisted", std::move(reference), [=](Vec3d p) {
    const Vec3d centre{0.5, 0.5, 0};
    return centre + turned(p - centre, degrees * p.z);
  });
}

/// A wall that swells under a boundary layer of hexahedra, whose sides follow.
inline Motion swollen_layer(double first) {
  return boundary_motion("swollen layer", formats::generate_layer({.first = first}).mesh,
                         [](Vec3d p) {
                           const double hill = 0.1 * std::sin(std::numbers::pi * p.x);
                           return p + Vec3d{0, 0, hill};
                         });
}

/// Smooth fields of a given amplitude, different for each seed.
inline Motion random_motion(const Mesh& reference, unsigned seed, double amplitude) {
  std::mt19937 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine()) / 4294967296.0; };
  struct Wave {
    Vec3d direction, way;
    double phase;
  };
  std::vector<Wave> waves;
  for (int w = 0; w < 3; ++w) {
    const auto vector = [&](double length) {
      return length * Vec3d{2 * uniform() - 1, 2 * uniform() - 1, 2 * uniform() - 1};
    };
    waves.push_back({vector(2 * std::numbers::pi), vector(amplitude), 6 * uniform()});
  }
  const bool plane = element_shape(reference.blocks.front().type).dimension == 2;
  return boundary_motion("random motion " + std::to_string(seed), reference, [=](Vec3d p) {
    Vec3d moved = p;
    for (const Wave& wave : waves) {
      moved += std::sin(dot(wave.direction, p) + wave.phase) * wave.way;
    }
    if (plane) moved.z = p.z;
    return moved;
  });
}

}  // namespace meshsmooth::test

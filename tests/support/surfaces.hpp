#pragma once

// Curved surface meshes whose elements are badly shaped, exactly on what they stand for.

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "support/meshes.hpp"

namespace meshsmooth::test {

/// A closed or open grid of n x m cells, thrown about by up to `size` of a cell where `may_move`
/// says so, mapped to space. Nodes that meet when a side is closed are one.
struct Grid {
  int n, m;
  bool closed_n, closed_m;

  [[nodiscard]] int columns() const { return closed_n ? n : n + 1; }
  [[nodiscard]] int rows() const { return closed_m ? m : m + 1; }
  [[nodiscard]] NodeId at(int i, int j) const {
    return static_cast<NodeId>((j % rows()) * columns() + i % columns());
  }

  template <class Map, class MayMove>
  [[nodiscard]] Mesh make(ElementType type, double size, const MayMove& may_move,
                          const Map& map) const {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> off(-size, size);
    std::vector<Vec3d> positions;
    for (int j = 0; j < rows(); ++j) {
      for (int i = 0; i < columns(); ++i) {
        const std::array<bool, 2> moves = may_move(i, j);
        const double u = off(random), v = off(random);
        positions.push_back(map((i + (moves[0] ? u : 0)) / n, (j + (moves[1] ? v : 0)) / m));
      }
    }
    std::vector<NodeId> nodes;
    for (int j = 0; j < m; ++j) {
      for (int i = 0; i < n; ++i) {
        const NodeId a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
        if (type == ElementType::quad) {
          nodes.insert(nodes.end(), {a, b, c, d});
        } else {
          nodes.insert(nodes.end(), {a, b, c, a, c, d});
        }
      }
    }
    return make_mesh(std::move(positions), {{type, std::move(nodes)}});
  }
};

inline constexpr auto kEverywhere = [](int, int) { return std::array{true, true}; };

inline Mesh torus(ElementType type, double size = 0.25) {
  return Grid{48, 24, true, true}.make(type, size, kEverywhere, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v,
                 radius = 1 + 0.4 * std::cos(b);
    return Vec3d{radius * std::cos(a), radius * std::sin(a), 0.4 * std::sin(b)};
  });
}

inline Mesh jittered_sphere(double size = 0.02) {
  Mesh mesh = noisy(sphere(4), size, 6);
  for (Vec3d& p : points(mesh)) p = (1 / norm(p)) * p;
  return mesh;
}

inline constexpr int kLength = 12, kProfile = 20;

/// An open sheet in the shape of an S, rounded at one turn, folded sharply at the other: column
/// kFold is a feature edge that is curved.
inline constexpr int kFold = 14;
inline Mesh bracket(ElementType type, double size = 0.3) {
  const auto may_move = [](int i, int j) {
    return std::array{i != kFold && i != 0 && i != kProfile, j != 0 && j != kLength};
  };
  return Grid{kProfile, kLength, false, false}.make(type, size, may_move, [](double u, double v) {
    const double s = u * kProfile, z = 8 * v;
    const double edge = 0.4 * std::sin(0.4 * z);  // the fold is wavy
    if (s <= 5) return Vec3d{-(5 - s) - 2, 0, z};
    if (s <= 9) {
      const double turn = (s - 5) / 4 * std::numbers::pi / 2;
      return Vec3d{-2 + 2 * std::sin(turn), 2 - 2 * std::cos(turn), z};
    }
    if (s <= kFold) return Vec3d{0, 2 + (s - 9) / (kFold - 9) * (4 + edge), z};
    return Vec3d{s - kFold, 6 + edge, z};
  });
}

inline std::vector<std::pair<std::string, Mesh>> surfaces() {
  return {{"torus of triangles", torus(ElementType::triangle)},
          {"torus of quads", torus(ElementType::quad)},
          {"sphere", jittered_sphere()},
          {"bracket of triangles", bracket(ElementType::triangle)},
          {"bracket of quads", bracket(ElementType::quad)}};
}

}  // namespace meshsmooth::test

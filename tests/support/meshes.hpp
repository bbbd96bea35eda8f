#pragma once

// Named small meshes: the vocabulary of the tests.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::test {

inline std::vector<Vec3d>& points(Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}
inline const std::vector<Vec3d>& points(const Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}

/// Node positions of the ideal element: all edges 1.
inline std::vector<Vec3d> ideal_points(ElementType type) {
  const double h = std::sqrt(3.0) / 2;
  switch (type) {
    case ElementType::triangle:
      return {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}};
    case ElementType::quad:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    case ElementType::tetrahedron:
      return {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0.5, h / 3, std::sqrt(2.0 / 3)}};
    case ElementType::pyramid:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, std::sqrt(0.5)}};
    case ElementType::wedge:  // VTK: the first triangle looks away from the second
      return {{0, 0, 0}, {0.5, h, 0}, {1, 0, 0}, {0, 0, 1}, {0.5, h, 1}, {1, 0, 1}};
    case ElementType::hexahedron:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
              {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    default:  // of second order
      break;
  }
  return {};
}

inline Mesh make_mesh(std::vector<Vec3d> positions, std::vector<ElementBlock> blocks) {
  Mesh mesh;
  mesh.positions = std::move(positions);
  mesh.blocks = std::move(blocks);
  return mesh;
}

/// One ideal element.
inline Mesh single(ElementType type) {
  std::vector<Vec3d> positions = ideal_points(type);
  std::vector<NodeId> nodes(positions.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] = static_cast<NodeId>(n);
  return make_mesh(std::move(positions), {{type, std::move(nodes)}});
}

/// Two tetrahedra on either side of the facet 0-1-2.
inline Mesh two_tets() {
  return make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 1}, {0.3, 0.3, -1}},
                   {{ElementType::tetrahedron, {0, 1, 2, 3, 0, 2, 1, 4}}});
}

/// Three tetrahedra on the facet 0-1-2.
inline Mesh overused_facet() {
  return make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 1}, {0.3, 0.3, -1}, {0.3, 0.3, 2}},
                   {{ElementType::tetrahedron, {0, 1, 2, 3, 0, 2, 1, 4, 0, 1, 2, 5}}});
}

/// A free node, number 6, inside an octahedron: eight tetrahedra. It lies off
/// the centre.
inline Mesh tet_ball() {
  Mesh mesh = make_mesh(
      {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0.2, 0.1, -0.15}},
      {{ElementType::tetrahedron, {}}});
  for (NodeId n = 0; n < 4; ++n) {
    const NodeId next = (n + 1) % 4;
    for (const NodeId node : {6, n, next, 4, 6, next, n, 5}) mesh.blocks[0].nodes.push_back(node);
  }
  return mesh;
}

/// A free node, number 6, in the middle of a plane hexagon of triangles.
inline Mesh triangle_ring() {
  Mesh mesh = make_mesh({}, {{ElementType::triangle, {}}});
  for (NodeId n = 0; n < 6; ++n) {
    const double angle = n * std::acos(-1.0) / 3;
    points(mesh).push_back({std::cos(angle), std::sin(angle), 0});
    for (const NodeId node : {6, n, (n + 1) % 6}) mesh.blocks[0].nodes.push_back(node);
  }
  points(mesh).push_back({0.25, -0.1, 0});
  return mesh;
}

/// A fan of triangles around the apex, number 0; open below.
inline Mesh open_cone(NodeId sides = 7) {
  Mesh mesh = make_mesh({{0.1, 0.05, 1}}, {{ElementType::triangle, {}}});
  for (NodeId n = 0; n < sides; ++n) {
    const double angle = 2 * n * std::acos(-1.0) / sides;
    points(mesh).push_back({std::cos(angle), std::sin(angle), 0});
    for (const NodeId node : {0, 1 + n, 1 + (n + 1) % sides}) mesh.blocks[0].nodes.push_back(node);
  }
  return mesh;
}

/// A closed surface: the octahedron, each facet split into four `levels` times,
/// on the unit sphere.
inline Mesh sphere(int levels) {
  Mesh mesh = make_mesh({{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                        {{ElementType::triangle, {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4,
                                                  1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5}}});
  for (; levels > 0; --levels) {
    std::map<std::pair<NodeId, NodeId>, NodeId> middles;
    const auto middle = [&](NodeId a, NodeId b) {
      const auto [at, added] =
          middles.try_emplace(std::minmax(a, b), static_cast<NodeId>(points(mesh).size()));
      if (added) {
        const Vec3d sum = points(mesh)[a] + points(mesh)[b];
        points(mesh).push_back((1 / norm(sum)) * sum);
      }
      return at->second;
    };
    std::vector<NodeId> finer;
    const std::vector<NodeId>& coarse = mesh.blocks[0].nodes;
    for (std::size_t t = 0; t < coarse.size(); t += 3) {
      const NodeId a = coarse[t], b = coarse[t + 1], c = coarse[t + 2];
      const NodeId ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const NodeId n : {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca}) finer.push_back(n);
    }
    mesh.blocks[0].nodes = std::move(finer);
  }
  return mesh;
}

/// Tetrahedra between a sphere and its centre, which has them all around it.
inline Mesh spokes(int levels) {
  Mesh mesh = sphere(levels);
  auto& positions = std::get<std::vector<Vec3d>>(mesh.positions);
  const auto centre = static_cast<NodeId>(positions.size());
  positions.push_back({0, 0, 0});
  const std::vector<NodeId> triangles = std::move(mesh.blocks[0].nodes);
  mesh.blocks = {{ElementType::tetrahedron, {}}};
  for (std::size_t n = 0; n < triangles.size(); n += 3) {
    for (const NodeId node : {centre, triangles[n], triangles[n + 1], triangles[n + 2]}) {
      mesh.blocks[0].nodes.push_back(node);
    }
  }
  return mesh;
}

/// A regular lattice of n^3 cubes (n^2 squares for surface elements), each cut
/// into elements of one type: 6 tetrahedra, 6 pyramids, 2 wedges, 2 triangles.
/// Every free node lies in the middle of its ring.
inline Mesh lattice(ElementType type, int n) {
  Mesh mesh = make_mesh({}, {{type, {}}});
  std::vector<NodeId>& nodes = mesh.blocks[0].nodes;
  const auto add = [&](std::initializer_list<NodeId> element) {
    nodes.insert(nodes.end(), element);
  };
  const bool surface = type == ElementType::triangle || type == ElementType::quad;
  for (int k = 0; k <= (surface ? 0 : n); ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        points(mesh).push_back({double(i), double(j), double(k)});
      }
    }
  }
  for (int k = 0; k < (surface ? 1 : n); ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const auto at = [&](int x, int y, int z) {
          return static_cast<NodeId>(((k + z) * (n + 1) + j + y) * (n + 1) + i + x);
        };
        const NodeId a = at(0, 0, 0), b = at(1, 0, 0), c = at(1, 1, 0), d = at(0, 1, 0);
        const NodeId e = at(0, 0, 1), f = at(1, 0, 1), g = at(1, 1, 1), h = at(0, 1, 1);
        switch (type) {
          case ElementType::triangle:
            add({a, b, c, a, c, d});
            break;
          case ElementType::quad:
            add({a, b, c, d});
            break;
          case ElementType::tetrahedron:  // along the diagonal a-g
            add({a, b, c, g, a, c, d, g, a, d, h, g, a, h, e, g, a, e, f, g, a, f, b, g});
            break;
          case ElementType::pyramid: {
            const auto m = static_cast<NodeId>(points(mesh).size());
            points(mesh).push_back({i + 0.5, j + 0.5, k + 0.5});
            add({a, b, c, d, m, e, h, g, f, m, a, e, f, b, m});
            add({b, f, g, c, m, c, g, h, d, m, d, h, e, a, m});
            break;
          }
          case ElementType::wedge:
            add({a, c, b, e, g, f, a, d, c, e, h, g});
            break;
          case ElementType::hexahedron:
            add({a, b, c, d, e, f, g, h});
            break;
          default:  // of second order
            break;
        }
      }
    }
  }
  return mesh;
}

/// All four volume types in one conforming mesh of n x n columns: cubes below;
/// then cubes cut into a pyramid on the lower one and tetrahedra; wedges on top.
inline Mesh mixed_stack(int n) {
  Mesh mesh = make_mesh({}, {{ElementType::hexahedron, {}},
                             {ElementType::pyramid, {}},
                             {ElementType::tetrahedron, {}},
                             {ElementType::wedge, {}}});
  const auto add = [&](std::size_t block, std::initializer_list<NodeId> element) {
    mesh.blocks[block].nodes.insert(mesh.blocks[block].nodes.end(), element);
  };
  for (int k = 0; k <= 3; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) points(mesh).push_back({double(i), double(j), double(k)});
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto at = [&](int x, int y, int z) {
        return static_cast<NodeId>((z * (n + 1) + j + y) * (n + 1) + i + x);
      };
      const auto layer = [&](int z) {
        return std::array<NodeId, 4>{at(0, 0, z), at(1, 0, z), at(1, 1, z), at(0, 1, z)};
      };
      const auto [a, b, c, d] = layer(0);
      const auto [e, f, g, h] = layer(1);
      const auto [p, q, r, s] = layer(2);
      const auto [t, u, v, w] = layer(3);
      const auto m = static_cast<NodeId>(points(mesh).size());
      points(mesh).push_back({i + 0.5, j + 0.5, 1.5});
      add(0, {a, b, c, d, e, f, g, h});
      add(1, {e, f, g, h, m});
      add(2, {p, r, q, m, p, s, r, m});                          // above
      add(2, {e, q, f, m, e, p, q, m, h, g, r, m, h, r, s, m});  // y = 0, y = 1
      add(2, {e, s, p, m, e, h, s, m, f, q, r, m, f, r, g, m});  // x = 0, x = 1
      add(3, {p, r, q, t, v, u, p, s, r, t, w, v});
    }
  }
  return mesh;
}

/// Two tetrahedra that share nothing.
inline Mesh disconnected_pieces() {
  Mesh mesh = single(ElementType::tetrahedron);
  for (const Vec3d& p : ideal_points(ElementType::tetrahedron)) {
    points(mesh).push_back(p + Vec3d{5, 0, 0});
  }
  for (const NodeId n : {4, 5, 6, 7}) mesh.blocks[0].nodes.push_back(n);
  return mesh;
}

/// The mesh with one more node, the last, that no element uses.
inline Mesh with_isolated_node(Mesh mesh) {
  points(mesh).push_back({0.123, 0.456, 0.789});
  if (!mesh.fixed.empty()) mesh.fixed.push_back(0);
  return mesh;
}

/// Every element turned inside out by its node order.
inline Mesh inverted(Mesh mesh) {
  for (ElementBlock& block : mesh.blocks) {
    const auto width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      NodeId* const nodes = &block.nodes[at];
      switch (block.type) {
        case ElementType::triangle:
        case ElementType::tetrahedron:
          std::swap(nodes[0], nodes[1]);
          break;
        case ElementType::quad:
        case ElementType::pyramid:
          std::swap(nodes[1], nodes[3]);
          break;
        case ElementType::wedge:
          for (int n = 0; n < 3; ++n) std::swap(nodes[n], nodes[n + 3]);
          break;
        case ElementType::hexahedron:
          for (int n = 0; n < 4; ++n) std::swap(nodes[n], nodes[n + 4]);
          break;
        default:  // of second order
          break;
      }
    }
  }
  return mesh;
}

/// Moves every node that lies inside the bounding box by up to `amplitude` along
/// each axis in which the mesh has an extent.
inline Mesh noisy(Mesh mesh, double amplitude, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(-amplitude, amplitude);
  Vec3d low = points(mesh).front(), high = low;
  for (const Vec3d& p : points(mesh)) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const auto inside = [](double l, double x, double h) { return l == h || (l < x && x < h); };
  for (Vec3d& p : points(mesh)) {
    const Vec3d move{noise(random), noise(random), noise(random)};
    if (!inside(low.x, p.x, high.x) || !inside(low.y, p.y, high.y) || !inside(low.z, p.z, high.z)) {
      continue;
    }
    if (low.x < high.x) p.x += move.x;
    if (low.y < high.y) p.y += move.y;
    if (low.z < high.z) p.z += move.z;
  }
  return mesh;
}

/// Blocks whose types alternate and are not in the order of the element table.
inline Mesh scattered_blocks(int n = 3) {
  Mesh mesh = noisy(mixed_stack(n), 0.1, 2);
  std::vector<ElementBlock> halves;
  for (const bool second : {true, false}) {
    for (const ElementBlock& block : mesh.blocks) {
      const auto width = element_width(block.type);
      const auto middle = static_cast<std::ptrdiff_t>(block.nodes.size() / width / 2 * width);
      const auto begin = block.nodes.begin() + (second ? middle : 0);
      const auto end = second ? block.nodes.end() : block.nodes.begin() + middle;
      halves.push_back({block.type, {begin, end}});
    }
  }
  mesh.blocks = std::move(halves);
  return mesh;
}

/// The same mesh in float32.
inline Mesh as_float32(const Mesh& mesh) {
  std::vector<Vec3f> rounded;
  for (const Vec3d& p : points(mesh)) rounded.push_back(vec3_cast<float>(p));
  Mesh result = mesh;
  result.positions = std::move(rounded);
  return result;
}

/// The positions in double, whatever the mesh stores.
inline std::vector<Vec3d> points_as_double(const Mesh& mesh) {
  std::vector<Vec3d> result;
  std::visit(
      [&](const auto& own) {
        for (const auto& p : own) result.push_back(vec3_cast<double>(p));
      },
      mesh.positions);
  return result;
}

/// Moves all nodes by `map`.
template <class Map>
Mesh mapped(Mesh mesh, const Map& map) {
  for (Vec3d& p : points(mesh)) p = map(p);
  return mesh;
}

}  // namespace meshsmooth::test

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "generate/check_node_count.hpp"
#include "generate/generate.hpp"
#include "generate/random.hpp"
#include "generate/tangle.hpp"

namespace meshsmooth::formats {
namespace {

constexpr double kJitter = 0.15;  // of the spacing; keeps all elements valid

/// A grid of n³ cells in the unit cube. The lower half are hexahedra in front
/// (small x) and pairs of wedges behind; in the upper half every cell is cut
/// into pyramids and tetrahedra around a node at its centre: a face shared
/// with a hexahedron carries a pyramid, any other two tetrahedra. All cut
/// faces are cut from their lowest to their highest corner, so they fit.
class MixedGrid {
 public:
  explicit MixedGrid(int cells) : cells_(cells) {
    const double spacing = 1.0 / cells;
    for (int k = 0; k <= cells; ++k) {
      for (int j = 0; j <= cells; ++j) {
        for (int i = 0; i <= cells; ++i) {
          const auto inner = [&](int index) { return index > 0 && index < cells; };
          add_node({spacing * i, spacing * j, spacing * k}, inner(i) && inner(j) && inner(k));
        }
      }
    }
    for (int k = 0; k < cells; ++k) {
      for (int j = 0; j < cells; ++j) {
        for (int i = 0; i < cells; ++i) fill_cell(i, j, k);
      }
    }
  }

  std::vector<Vec3d> nodes;
  std::vector<std::uint8_t> inside;
  std::vector<ElementBlock> blocks = {{ElementType::hexahedron, {}},
                                      {ElementType::wedge, {}},
                                      {ElementType::pyramid, {}},
                                      {ElementType::tetrahedron, {}}};

 private:
  NodeId add_node(Vec3d place, bool is_inside) {
    nodes.push_back(place);
    inside.push_back(is_inside ? 1 : 0);
    return static_cast<NodeId>(nodes.size()) - 1;
  }
  [[nodiscard]] NodeId node(int i, int j, int k) const {
    return (k * (cells_ + 1) + j) * (cells_ + 1) + i;
  }
  [[nodiscard]] bool is_upper(int k) const { return 2 * k >= cells_; }
  [[nodiscard]] bool is_front(int i) const { return 2 * i < cells_; }

  void add(std::size_t block, std::initializer_list<NodeId> corners) {
    auto& list = blocks[block].nodes;
    list.insert(list.end(), corners);
  }

  void fill_cell(int i, int j, int k) {
    const std::array<NodeId, 8> c = {
        node(i, j, k),     node(i + 1, j, k),     node(i + 1, j + 1, k),     node(i, j + 1, k),
        node(i, j, k + 1), node(i + 1, j, k + 1), node(i + 1, j + 1, k + 1), node(i, j + 1, k + 1)};
    if (is_upper(k)) {
      fill_around_centre(i, j, k, c);
    } else if (is_front(i)) {
      add(0, {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]});
    } else {
      add(1, {c[0], c[2], c[1], c[4], c[6], c[5]});
      add(1, {c[0], c[3], c[2], c[4], c[7], c[6]});
    }
  }

  void fill_around_centre(int i, int j, int k, const std::array<NodeId, 8>& c) {
    const double spacing = 1.0 / cells_;
    const NodeId centre =
        add_node({spacing * (i + 0.5), spacing * (j + 0.5), spacing * (k + 0.5)}, true);
    const bool on_hexahedron = k > 0 && !is_upper(k - 1) && is_front(i);
    // Seen from the centre each face runs counter-clockwise, from its lowest
    // corner; its third corner is the highest.
    if (on_hexahedron) {
      add(2, {c[0], c[1], c[2], c[3], centre});
    } else {
      add_cut_face(c[0], c[1], c[2], c[3], centre);
    }
    add_cut_face(c[4], c[7], c[6], c[5], centre);
    add_cut_face(c[0], c[3], c[7], c[4], centre);
    add_cut_face(c[1], c[5], c[6], c[2], centre);
    add_cut_face(c[0], c[4], c[5], c[1], centre);
    add_cut_face(c[3], c[2], c[6], c[7], centre);
  }

  void add_cut_face(NodeId a, NodeId b, NodeId c, NodeId d, NodeId centre) {
    add(3, {a, b, c, centre});
    add(3, {a, c, d, centre});
  }

  int cells_;
};

/// A face of an octahedron cut into size² triangles, on the unit sphere.
class SphereGrid {
 public:
  explicit SphereGrid(int size) : size_(size) {
    for (const int x : {-1, 1}) {
      for (const int y : {-1, 1}) {
        for (const int z : {-1, 1}) fill_octant({x, y, z});
      }
    }
  }
  std::vector<Vec3d> nodes;
  std::vector<NodeId> triangles;

 private:
  using Key = std::array<int, 3>;  // absolute values add up to size_

  NodeId node(const Key& key) {
    const auto [place, is_new] = nodes_.try_emplace(key, static_cast<NodeId>(nodes.size()));
    if (is_new) {
      const Vec3d flat = {double(key[0]), double(key[1]), double(key[2])};
      nodes.push_back((1.0 / norm(flat)) * flat);
    }
    return place->second;
  }
  void add(const Key& sign, int a, int b, int da, int db) {
    const auto corner = [&](int i, int j) {
      return node({sign[0] * i, sign[1] * j, sign[2] * (size_ - i - j)});
    };
    std::array<NodeId, 3> cell = {corner(a, b), corner(a + da, b), corner(a, b + db)};
    if (sign[0] * sign[1] * sign[2] * da * db < 0) std::swap(cell[1], cell[2]);
    triangles.insert(triangles.end(), cell.begin(), cell.end());
  }
  void fill_octant(const Key& sign) {
    for (int a = 0; a < size_; ++a) {
      for (int b = 0; a + b < size_; ++b) {
        add(sign, a, b, 1, 1);
        if (a > 0 && b > 0) add(sign, a, b, -1, -1);
      }
    }
    for (int a = 1; a < size_; ++a) add(sign, a, size_ - a, -1, -1);
  }

  int size_;
  std::map<Key, NodeId> nodes_;
};

}  // namespace

Mesh generate_mixed(std::size_t node_count, std::uint64_t seed, double share) {
  check_node_count(node_count, 30);
  check_tangle(share);
  // (n + 1)³ grid nodes and n³ / 2 centres.
  int cells = 2;
  const auto nodes_of = [](double n) { return std::pow(n + 1, 3) + n * n * n / 2; };
  while (nodes_of(cells + 0.5) < static_cast<double>(node_count)) ++cells;
  MixedGrid grid(cells);
  Random random(seed);
  for (std::size_t node = 0; node < grid.nodes.size(); ++node) {
    const Vec3d jitter = random.vector(kJitter / cells);
    if (grid.inside[node] != 0) grid.nodes[node] += jitter;
  }
  Mesh mesh;
  mesh.positions = std::move(grid.nodes);
  mesh.blocks = std::move(grid.blocks);
  tangle(mesh, grid.inside, share, seed);
  return mesh;
}

Mesh generate_square(std::size_t node_count, std::uint64_t seed, double share) {
  check_node_count(node_count, 9);
  check_tangle(share);
  const int cells = static_cast<int>(std::lround(std::sqrt(static_cast<double>(node_count)))) - 1;
  std::vector<Vec3d> nodes;
  std::vector<std::uint8_t> inside;
  std::vector<NodeId> triangles;
  Random random(seed);
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      Vec3d place = {double(i) / cells, double(j) / cells, 0};
      Vec3d jitter = random.vector(kJitter / cells);
      jitter.z = 0;
      nodes.push_back(inner ? place + jitter : place);
      inside.push_back(inner ? 1 : 0);
      if (i == cells || j == cells) continue;
      const NodeId a = j * (cells + 1) + i;
      const NodeId d = a + cells + 1;
      if ((i + j) % 2 == 0) {
        triangles.insert(triangles.end(), {a, a + 1, d + 1, a, d + 1, d});
      } else {
        triangles.insert(triangles.end(), {a, a + 1, d, a + 1, d + 1, d});
      }
    }
  }
  Mesh mesh;
  mesh.positions = std::move(nodes);
  mesh.blocks.push_back({ElementType::triangle, std::move(triangles)});
  tangle(mesh, inside, share, seed);
  return mesh;
}

Mesh generate_sphere(std::size_t node_count, std::uint64_t seed, double noise) {
  check_node_count(node_count, 6);
  if (!(noise >= 0 && noise <= 0.5)) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "noise " + std::to_string(noise) + " is not in [0, 0.5]",
                        {{"field", "noise"}});
  }
  // 4 n² + 2 nodes.
  const double size = std::sqrt((static_cast<double>(node_count) - 2) / 4);
  SphereGrid grid(std::max(1, static_cast<int>(std::lround(size))));
  Random random(seed);
  for (Vec3d& node : grid.nodes) node = (1 + random.between(-noise, noise)) * node;
  Mesh mesh;
  mesh.positions = std::move(grid.nodes);
  mesh.blocks.push_back({ElementType::triangle, std::move(grid.triangles)});
  return mesh;
}

}  // namespace meshsmooth::formats

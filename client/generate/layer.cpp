#include <algorithm>
#include <cmath>
#include <utility>

#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/cell_grid.hpp"
#include "generate/hash.hpp"
#include "generate/tangle.hpp"

namespace meshsmooth::formats {
namespace {

bool is_plane(LayerElements elements) {
  return elements == LayerElements::quads || elements == LayerElements::triangles;
}

ElementType type_of(LayerElements elements) {
  switch (elements) {
    case LayerElements::hexahedra:
      return ElementType::hexahedron;
    case LayerElements::wedges:
      return ElementType::wedge;
    case LayerElements::tetrahedra:
      return ElementType::tetrahedron;
    case LayerElements::quads:
      return ElementType::quad;
    case LayerElements::triangles:
      return ElementType::triangle;
  }
  return ElementType::hexahedron;
}

void add_elements(std::vector<NodeId>& nodes, LayerElements elements,
                  const std::array<NodeId, 8>& c) {
  switch (elements) {
    case LayerElements::hexahedra:
      nodes.insert(nodes.end(), c.begin(), c.end());
      break;
    case LayerElements::wedges:
      nodes.insert(nodes.end(), {c[0], c[2], c[1], c[4], c[6], c[5]});
      nodes.insert(nodes.end(), {c[0], c[3], c[2], c[4], c[7], c[6]});
      break;
    case LayerElements::tetrahedra:
      add_kuhn_tetrahedra(nodes, c);
      break;
    case LayerElements::quads:
      nodes.insert(nodes.end(), c.begin(), c.begin() + 4);
      break;
    case LayerElements::triangles:
      nodes.insert(nodes.end(), {c[0], c[1], c[2], c[0], c[2], c[3]});
      break;
  }
}

/// Levels of nodes above the wall; `wall_axis` of the grid is y in the plane, else z.
class LayerMesh {
 public:
  explicit LayerMesh(const LayerOptions& options)
      : options_(options),
        plane_(is_plane(options.elements)),
        layers_(options.cells[2]),
        grid_(plane_ ? CellGrid{options.cells[0], layers_ + options.core, 0}
                     : CellGrid{options.cells[0], options.cells[1], layers_ + options.core}) {
    double height = options.first;
    heights_.reserve(static_cast<std::size_t>(layers_ + options.core));
    for (int n = 0; n < layers_; ++n, height *= options.growth) heights_.push_back(height);
    heights_.resize(heights_.size() + static_cast<std::size_t>(options.core),
                    1.0 / options.cells[0]);
    levels_ = {0};
    for (const double each : heights_) levels_.push_back(levels_.back() + each);
  }

  [[nodiscard]] MeshFile make_file() const {
    Mesh mesh;
    std::vector<std::uint8_t> fixed;
    std::vector<std::uint8_t> in_core;
    std::vector<Vec3d> nodes;
    grid_.for_each_node([&](int i, int j, int k) {
      const int level = plane_ ? j : k;
      nodes.push_back(jittered(i, j, k));
      fixed.push_back(level == 0 || level == level_count() ? 1 : 0);
      in_core.push_back(is_inside(i, j, k) && level > layers_ ? 1 : 0);
    });
    mesh.positions = std::move(nodes);
    auto [layer_part, core_part, numbers] = make_elements();
    if (options_.tangle > 0) {
      // Only the core's elements are counted.
      mesh.blocks = {core_part};
      tangle(mesh, in_core, options_.tangle, options_.seed);
      mesh.blocks.clear();
    }
    auto& all = layer_part.nodes;
    all.insert(all.end(), core_part.nodes.begin(), core_part.nodes.end());
    mesh.blocks.push_back(std::move(layer_part));
    return make_case_file(std::move(mesh), fixed, numbers);
  }

 private:
  struct Elements {
    ElementBlock layers;
    ElementBlock core;
    std::vector<std::int32_t> numbers;  // of the layer, for all elements
  };

  [[nodiscard]] int level_count() const { return layers_ + options_.core; }

  [[nodiscard]] bool is_inside(int i, int j, int k) const {
    const auto inner = [](int index, int count) { return index > 0 && index < count; };
    return inner(i, grid_.x) && inner(j, grid_.y) && (plane_ || inner(k, grid_.z));
  }

  [[nodiscard]] Vec3d jittered(int i, int j, int k) const {
    const int level = plane_ ? j : k;
    const double height = levels_[static_cast<std::size_t>(level)];
    const double x = double(i) / grid_.x;
    const Vec3d start = plane_ ? Vec3d{x, height, 0} : Vec3d{x, double(j) / grid_.y, height};
    if (options_.jitter == 0 || !is_inside(i, j, k) || level >= layers_) return start;
    const auto below = static_cast<std::size_t>(level - 1);
    const double size = options_.jitter * std::min(heights_[below], heights_[below + 1]);
    const auto node = static_cast<std::uint64_t>(grid_.node(i, j, k));
    const auto component = [&](std::uint64_t axis) {
      return size * signed_hash(options_.seed, node, axis);
    };
    return start + Vec3d{component(0), component(1), plane_ ? 0 : component(2)};
  }

  [[nodiscard]] Elements make_elements() const {
    const ElementType type = type_of(options_.elements);
    const auto corners = element_width(type);
    Elements made{{type, {}}, {type, {}}, {}};
    const auto add = [&](int level, const std::array<NodeId, 8>& cell) {
      std::vector<NodeId>& nodes = (level < layers_ ? made.layers : made.core).nodes;
      const std::size_t before = nodes.size();
      add_elements(nodes, options_.elements, cell);
      made.numbers.insert(made.numbers.end(), (nodes.size() - before) / corners,
                          level < layers_ ? level + 1 : 0);
    };
    // In the plane one sheet of nodes; only the lower corners of its cells are used.
    const CellGrid cells{grid_.x, grid_.y, plane_ ? 1 : grid_.z};
    cells.for_each_cell([&](int i, int j, int k) { add(plane_ ? j : k, grid_.corners(i, j, k)); });
    return made;
  }

  const LayerOptions& options_;
  bool plane_;
  int layers_;
  CellGrid grid_;
  std::vector<double> heights_;  // of the layers and the core's
  std::vector<double> levels_;
};

}  // namespace

MeshFile generate_layer(const LayerOptions& options) {
  const bool plane = is_plane(options.elements);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis != 1 || !plane) check_option("cells", options.cells[axis], 1, 10000);
  }
  check_option("first", options.first, 1e-9, 1e3);
  check_option("growth", options.growth, 0.1, 10);
  check_option("jitter", options.jitter, 0, 1);
  check_option("core", options.core, 0, 10000);
  check_tangle(options.tangle);
  if (options.tangle > 0 && options.core < 2) {
    throw InvalidOption(
        "OPTION_OUT_OF_RANGE",
        "tangle needs a core of at least 2 layers, not " + std::to_string(options.core),
        {{"field", "tangle"}});
  }
  const double along = (options.cells[0] + 1.0) * (plane ? 1 : options.cells[1] + 1.0);
  check_mesh_size(along * (options.cells[2] + options.core + 1.0), "cells or core");
  const double top = options.first * std::pow(options.growth, options.cells[2]);
  check_option("height of the last layer", top / options.growth, 1e-12, 1e6);
  return LayerMesh(options).make_file();
}

}  // namespace meshsmooth::formats

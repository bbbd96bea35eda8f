#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/cuts.hpp"
#include "generate/rotation.hpp"

namespace meshsmooth::formats {
namespace {

constexpr double kInner = 0.4;
constexpr double kOuter = 1;

/// Nodes around, outward and upward.
class HubGrid {
 public:
  explicit HubGrid(const HubOptions& options)
      : rows_(options.rows), around_(4 * options.rows), layers_(options.layers) {
    for (int k = 0; k <= layers_; ++k) {
      for (int j = 0; j <= rows_; ++j) {
        for (int i = 0; i < around_; ++i) {
          nodes_.push_back(rotated(position(i, j, k), {}, j == 0 ? options.degrees : 0));
          fixed_.push_back(j == 0 || j == rows_ ? 1 : 0);
        }
      }
    }
  }

  [[nodiscard]] const std::vector<std::uint8_t>& fixed() const { return fixed_; }

  [[nodiscard]] Mesh make_mesh() const {
    Mesh mesh;
    mesh.positions = nodes_;
    const bool plane = layers_ == 0;
    std::vector<NodeId> elements;
    const auto add = [&](const std::array<NodeId, 3>& triangle, int k) {
      const auto plane_nodes = static_cast<NodeId>(around_ * (rows_ + 1));
      const NodeId first = k * plane_nodes;
      const std::array<NodeId, 3> base = {triangle[0] + first, triangle[1] + first,
                                          triangle[2] + first};
      if (plane) {
        elements.insert(elements.end(), base.begin(), base.end());
      } else {
        add_prism_tetrahedra(elements, base, plane_nodes);
      }
    };
    for (int k = 0; k < (plane ? 1 : layers_); ++k) {
      for (int j = 0; j < rows_; ++j) {
        for (int i = 0; i < around_; ++i) {
          // The outer row is ahead by half an edge of an even row, behind of an odd one.
          const NodeId inner = node(i, j), inner_next = node(i + 1, j);
          const NodeId outer = node(i, j + 1), outer_next = node(i + 1, j + 1);
          if (j % 2 == 0) {
            add({inner, outer, inner_next}, k);
            add({inner_next, outer, outer_next}, k);
          } else {
            add({inner, outer, outer_next}, k);
            add({inner, outer_next, inner_next}, k);
          }
        }
      }
    }
    mesh.blocks.push_back(
        {plane ? ElementType::triangle : ElementType::tetrahedron, std::move(elements)});
    return mesh;
  }

 private:
  [[nodiscard]] Vec3d position(int i, int j, int k) const {
    const double width = (kOuter - kInner) / rows_;
    const double radius = j == rows_ ? kOuter : kInner + j * width;
    const double turns = (i + 0.5 * (j % 2)) / around_;
    const double angle = 2 * std::numbers::pi * turns;
    return {radius * std::cos(angle), radius * std::sin(angle), k * width};
  }
  [[nodiscard]] NodeId node(int i, int j) const { return j * around_ + i % around_; }

  int rows_;
  int around_;
  int layers_;
  std::vector<Vec3d> nodes_;
  std::vector<std::uint8_t> fixed_;
};

}  // namespace

MeshFile generate_hub(const HubOptions& options) {
  check_option("rows", options.rows, 1, 5000);
  check_option("degrees", options.degrees, -360, 360);
  check_option("layers", options.layers, 0, 5000);
  const double rows = options.rows;
  check_mesh_size(4 * rows * (rows + 1) * (options.layers + 1.0), "rows or layers");
  const HubGrid grid(options);
  return make_case_file(grid.make_mesh(), grid.fixed());
}

}  // namespace meshsmooth::formats

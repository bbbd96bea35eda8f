#include "meshsmooth/surface_of.hpp"

#include <array>
#include <span>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

using Triangle = std::array<std::int32_t, 3>;

/// The triangles of an element, by its nodes; corners first, then the middles of edges in their
/// order, then that of the face.
[[nodiscard]] std::span<const Triangle> triangles_of(ElementType type) {
  static constexpr Triangle kTriangle[] = {{0, 1, 2}};
  static constexpr Triangle kQuad[] = {{0, 1, 2}, {0, 2, 3}};
  static constexpr Triangle kTriangle6[] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
  static constexpr Triangle kQuad8[] = {{0, 4, 7}, {4, 1, 5}, {5, 2, 6},
                                        {6, 3, 7}, {4, 5, 6}, {4, 6, 7}};
  static constexpr Triangle kQuad9[] = {{0, 4, 8}, {4, 1, 8}, {1, 5, 8}, {5, 2, 8},
                                        {2, 6, 8}, {6, 3, 8}, {3, 7, 8}, {7, 0, 8}};
  switch (type) {
    case ElementType::triangle:
      return kTriangle;
    case ElementType::quad:
      return kQuad;
    case ElementType::triangle6:
      return kTriangle6;
    case ElementType::quad8:
      return kQuad8;
    case ElementType::quad9:
      return kQuad9;
    default:
      return {};
  }
}

}  // namespace

SurfaceMesh surface_of(const Mesh& mesh) {
  SurfaceMesh result;
  std::visit(
      [&](const auto& positions) {
        for (const auto& p : positions) result.points.push_back(vec3_cast<double>(p));
      },
      mesh.positions);
  std::size_t element = 0;
  for (const ElementBlock& block : mesh.blocks) {
    const auto triangles = triangles_of(block.type);
    if (triangles.empty()) {
      throw InvalidMesh("SURFACE_INVALID", "target surface: the mesh has volume elements (" +
                                               std::string(element_name(block.type)) +
                                               "); give one of its boundary alone");
    }
    const std::size_t width = element_width(block.type);
    for (std::size_t e = 0; e < block.nodes.size(); e += width, ++element) {
      for (const Triangle& t : triangles) {
        const auto node = [&](std::size_t k) { return block.nodes[e + std::size_t(t[k])]; };
        result.triangles.push_back({node(0), node(1), node(2)});
        if (!mesh.regions.empty()) result.patches.push_back(mesh.regions[element]);
      }
    }
  }
  return result;
}

}  // namespace meshsmooth

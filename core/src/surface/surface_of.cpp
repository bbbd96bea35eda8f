#include "meshsmooth/surface_of.hpp"

#include <array>
#include <span>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth {
namespace {

using Triangle = std::array<std::int32_t, 3>;

/// The triangles of an element, by its nodes.
[[nodiscard]] std::span<const Triangle> triangles_of(ElementType type) {
  switch (type) {
#include "surface/element_triangles.inc"
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

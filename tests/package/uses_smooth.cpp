#include <meshsmooth/smoother.hpp>

int main() {
  meshsmooth::Mesh mesh;
  mesh.positions =
      std::vector<meshsmooth::Vec3d>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.2, 0.3, 0}};
  mesh.blocks = {{meshsmooth::ElementType::triangle, {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4}}};
  const auto summary =
      meshsmooth::make_smoother("cpu")->smooth(mesh, {.method = meshsmooth::Laplacian{}});
  return summary.nodes.moved == 1 && summary.quality_after.inverted_count == 0 ? 0 : 1;
}

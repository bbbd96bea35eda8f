// Smooths one tetrahedron, split into four at an off-centre node, on a server at HOST:PORT.
#include <iostream>
#include <meshsmooth/client.hpp>

int main(int, char** argv) {
  meshsmooth::Mesh mesh;
  mesh.positions =
      std::vector<meshsmooth::Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 0.1}};
  mesh.blocks = {
      {meshsmooth::ElementType::tetrahedron, {4, 1, 2, 3, 0, 4, 2, 3, 0, 1, 4, 3, 0, 1, 2, 4}}};

  meshsmooth::client::Client client(argv[1]);
  const auto report = client.smooth(mesh, {.method = meshsmooth::Optimize{}});

  std::cout << "inverted: " << report.summary.quality_after.inverted_count
            << ", moved: " << report.summary.nodes.moved << '\n';
}

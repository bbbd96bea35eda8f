// A time-step loop on a server at HOST:PORT: the top of a block is pushed down step by step and the
// inner nodes follow. The elements stay the same, so a session sends them once; every later step
// sends positions only.
#include <cmath>
#include <iostream>
#include <meshsmooth/client.hpp>
#include <span>

#include "grid.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: moving_mesh HOST:PORT\n";
    return 2;
  }
  meshsmooth::Mesh mesh = make_grid(12);
  auto& positions = std::get<std::vector<meshsmooth::Vec3d>>(mesh.positions);

  std::vector<std::size_t> top;
  for (std::size_t node = 0; node < positions.size(); ++node)
    if (positions[node].z == 1) top.push_back(node);

  meshsmooth::SmoothOptions options;
  options.method = meshsmooth::Optimize{};
  options.max_iterations = 20;

  try {
    meshsmooth::client::Client client(argv[1]);
    meshsmooth::client::Session session = client.open(mesh);
    std::cout << "topology: " << session.topology_name() << '\n';

    int reused = 0;
    std::int64_t inverted = 0;
    constexpr int kSteps = 10;
    for (int step = 1; step <= kSteps; ++step) {
      // The simulation's part: dent the top face. Boundary nodes stay where they are put
      // (BoundaryPolicy::fixed, the default); smoothing moves the inner ones.
      for (const std::size_t node : top) {
        auto& [x, y, z] = positions[node];
        z -= 0.04 * std::sin(M_PI * x) * std::sin(M_PI * y);
      }

      const auto report = session.smooth(std::span(positions), options);
      const auto& summary = report.summary;
      reused += report.topology_reused ? 1 : 0;
      inverted += summary.quality_after.inverted_count;
      std::cout << "step " << step << ": " << summary.convergence.iteration_count
                << " sweeps, inverted " << summary.quality_before.inverted_count << " -> "
                << summary.quality_after.inverted_count << '\n';
    }
    std::cout << "inverted after all steps: " << inverted
              << ", steps that reused the topology: " << reused << '\n';
  } catch (const meshsmooth::client::ServiceError& error) {
    std::cerr << error.reason() << ": " << error.what() << '\n' << error.hint() << '\n';
    return 1;
  }
}

// A rotor in a fixed ring, on a server at HOST:PORT: each time step turns the inner circle of an
// annulus and the mesh between the circles follows. The server keeps elements and positions of the
// first mesh, so a step sends the rotor's nodes alone; its result does not depend on earlier steps.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <meshsmooth/client.hpp>
#include <span>
#include <vector>

using meshsmooth::NodeId;
using meshsmooth::Vec3d;

constexpr int kAround = 48;
constexpr int kRows = 12;

/// Triangles between the circles of the radii 0.4 and 1; the nodes of the inner one come first.
meshsmooth::Mesh make_ring() {
  std::vector<Vec3d> positions;
  std::vector<NodeId> triangles;
  for (int row = 0; row <= kRows; ++row) {
    const double radius = 0.4 + 0.6 * row / kRows;
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * M_PI * (i + 0.5 * (row % 2)) / kAround;
      positions.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
      if (row == kRows) continue;
      const NodeId a = row * kAround + i, b = row * kAround + (i + 1) % kAround;
      const NodeId c = a + kAround, d = b + kAround;
      const auto row_of =
          row % 2 == 0 ? std::vector{a, c, b, b, c, d} : std::vector{a, d, b, a, c, d};
      triangles.insert(triangles.end(), row_of.begin(), row_of.end());
    }
  }
  meshsmooth::Mesh mesh;
  mesh.positions = std::move(positions);
  mesh.blocks = {{meshsmooth::ElementType::triangle, std::move(triangles)}};
  return mesh;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: moving_boundary HOST:PORT\n";
    return 2;
  }
  const meshsmooth::Mesh mesh = make_ring();
  const auto& first = std::get<std::vector<Vec3d>>(mesh.positions);
  std::vector<NodeId> rotor(kAround);  // all other nodes of the boundary stay
  for (int i = 0; i < kAround; ++i) rotor[i] = i;

  try {
    meshsmooth::client::Client client(argv[1]);
    meshsmooth::client::Session session = client.open(mesh);
    constexpr int kSteps = 24;
    for (int step = 1; step <= kSteps; ++step) {
      // The simulation's part: the rotor swings by 45 degrees to either side.
      const double angle = M_PI / 4 * std::sin(2 * M_PI * step / kSteps);
      std::vector<Vec3d> there;
      for (const NodeId node : rotor) {
        const auto [x, y, z] = first[node];
        there.push_back({x * std::cos(angle) - y * std::sin(angle),
                         x * std::sin(angle) + y * std::cos(angle), z});
      }
      const auto report = session.move(rotor, std::span<const Vec3d>(there));
      const auto& motion = report.summary.motion.value();
      std::cout << "step " << step << ": reached " << 100 * motion.reached << " % of "
                << 180 / M_PI * angle << " degrees, inverted "
                << report.summary.quality_after.inverted_count << '\n';
      if (motion.reached < 1) {
        // The mesh is valid, but the rotor stopped on its way: take smaller steps or remesh.
        std::cerr << motion.blocking_element_count << " elements are in the way\n";
        return 1;
      }
    }
    // The mesh after the last step; a cycle ends where it began.
    const auto last = std::get<std::span<const Vec3d>>(session.positions());
    double farthest = 0;
    for (std::size_t node = 0; node < last.size(); ++node)
      farthest = std::max(farthest,
                          std::hypot(last[node].x - first[node].x, last[node].y - first[node].y));
    std::cout << "largest distance from the first mesh: " << farthest << '\n';
  } catch (const meshsmooth::client::ServiceError& error) {
    std::cerr << error.reason() << ": " << error.what() << '\n' << error.hint() << '\n';
    return 1;
  }
}

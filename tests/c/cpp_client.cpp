// The C++ client on the meshes that tests of the C library send: its bits are what theirs must be.
//   cpp_client TARGET smooth|smooth32|worst|taubin|session|move < MESH > POSITIONS
// MESH: numbers of nodes, tetrahedra and prescribed nodes as int64, float64 coordinates, int32
// nodes of the tetrahedra, int32 prescribed nodes, and their float64 positions.
#include <cstdint>
#include <iostream>
#include <meshsmooth/client.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

using meshsmooth::Vec3d;

namespace {

template <class Value>
std::vector<Value> read(std::int64_t count) {
  std::vector<Value> values(static_cast<std::size_t>(count));
  std::cin.read(reinterpret_cast<char*>(values.data()),
                static_cast<std::streamsize>(values.size() * sizeof(Value)));
  return values;
}

template <class Real>
void write(std::span<const meshsmooth::Vec3<Real>> positions) {
  std::cout.write(reinterpret_cast<const char*>(positions.data()),
                  static_cast<std::streamsize>(positions.size_bytes()));
}

}  // namespace

int main(int, char** argv) {
  const auto counts = read<std::int64_t>(3);
  auto positions = read<Vec3d>(counts[0]);
  meshsmooth::Mesh mesh;
  mesh.positions = positions;
  mesh.blocks = {{meshsmooth::ElementType::tetrahedron, read<meshsmooth::NodeId>(4 * counts[1])}};
  const auto nodes = read<meshsmooth::NodeId>(counts[2]);
  const auto places = read<Vec3d>(counts[2]);

  meshsmooth::client::Client client(argv[1]);
  const std::string what = argv[2];
  if (what == "smooth32") {
    std::vector<meshsmooth::Vec3f> narrow;
    for (const Vec3d& position : positions) {
      narrow.push_back(meshsmooth::vec3_cast<float>(position));
    }
    mesh.positions = narrow;
    client.smooth(mesh, {});
    write(std::span<const meshsmooth::Vec3f>(
        std::get<std::vector<meshsmooth::Vec3f>>(mesh.positions)));
  } else if (what == "smooth" || what == "worst") {
    const auto goal = what == "worst" ? meshsmooth::Goal::worst : meshsmooth::Goal::balanced;
    client.smooth(mesh, {.method = meshsmooth::Optimize{.goal = goal}});
    write(std::span<const Vec3d>(std::get<std::vector<Vec3d>>(mesh.positions)));
  } else if (what == "taubin") {
    client.smooth(mesh, {.method = meshsmooth::Taubin{.lambda = 0.5, .mu = -0.55},
                         .max_iterations = 7,
                         .boundary = meshsmooth::BoundaryPolicy::free,
                         .guard = false,
                         .movement_limit = meshsmooth::MovementLimit{0.02, true},
                         .never_worse = false});
    write(std::span<const Vec3d>(std::get<std::vector<Vec3d>>(mesh.positions)));
  } else if (what == "session") {
    auto session = client.open(mesh);
    for (int step = 0; step < 2; ++step) {
      session.smooth(std::span(positions), {.max_iterations = 1});
    }
    write(std::span<const Vec3d>(positions));
  } else if (what == "move") {
    auto session = client.open(mesh);
    session.move(nodes, std::span<const Vec3d>(places));
    write(std::get<std::span<const Vec3d>>(session.positions()));
  } else {
    return 2;
  }
}

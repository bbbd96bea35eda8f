#include <gmsh.h>

#include <algorithm>

#include "generate/case_file.hpp"
#include "generate/cases.hpp"
#include "generate/gmsh_model.hpp"

namespace meshsmooth::formats {
namespace {

/// The unit cube without the ball; the surfaces of the hole.
std::vector<int> build_box(const BoxSphereOptions& options) {
  namespace occ = gmsh::model::occ;
  const int box = occ::addBox(0, 0, 0, 1, 1, 1);
  const int ball = occ::addSphere(0.5, 0.5, 0.5, options.radius);
  gmsh::vectorpair solids;
  std::vector<gmsh::vectorpair> origins;
  occ::cut({{3, box}}, {{3, ball}}, solids, origins);
  occ::synchronize();
  gmsh::option::setNumber("Mesh.MeshSizeMin", options.size);
  gmsh::option::setNumber("Mesh.MeshSizeMax", options.size);
  gmsh::vectorpair surfaces;
  gmsh::model::getEntities(surfaces, 2);
  std::vector<int> hole;
  for (const auto& [dimension, surface] : surfaces) {
    std::string type;
    gmsh::model::getType(dimension, surface, type);
    if (type != "Plane") hole.push_back(surface);
  }
  return hole;
}

}  // namespace

MeshFile generate_box_sphere(const BoxSphereOptions& options) {
  check_option("radius", options.radius, 0.05, 0.45);
  check_option("size", options.size, 0.005, std::min(0.25, options.radius));
  check_option("move", options.move, -0.95, 0.95);
  std::vector<std::uint8_t> fixed;
  std::vector<int> hole;
  Mesh mesh = make_with_gmsh(
      "box-sphere", 3, [&] { hole = build_box(options); },
      [&](GmshMesh& made) {
        auto& nodes = std::get<std::vector<Vec3d>>(made.mesh.positions);
        fixed.assign(nodes.size(), 0);
        for (const int surface : hole) {
          for_each_node_of(made, 2, surface, [&](std::size_t node) { fixed[node] = 1; });
        }
        const double distance = options.move * (0.5 - options.radius);
        for (std::size_t node = 0; node < nodes.size(); ++node) {
          if (fixed[node] != 0) nodes[node].x += distance;
        }
      });
  return make_case_file(std::move(mesh), fixed);
}

}  // namespace meshsmooth::formats

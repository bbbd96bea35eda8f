#include "generate/gmsh_model.hpp"

#include <algorithm>

#include "formats/gmsh_session.hpp"

namespace meshsmooth::formats {
namespace {

GmshMesh take_mesh(int dimension) {
  constexpr int kTriangle = 2;  // Gmsh's numbers of the types
  constexpr int kTetrahedron = 4;
  std::vector<std::size_t> numbers;
  std::vector<std::size_t> corners;
  gmsh::model::mesh::getElementsByType(dimension == 2 ? kTriangle : kTetrahedron, numbers, corners);
  std::vector<std::size_t> tags;
  std::vector<double> coordinates;
  std::vector<double> parameters;
  gmsh::model::mesh::getNodes(tags, coordinates, parameters);
  GmshMesh made;
  const std::size_t last = tags.empty() ? 0 : *std::max_element(tags.begin(), tags.end());
  made.node_of_tag.assign(last + 1, -1);
  for (const std::size_t tag : corners) made.node_of_tag.at(tag) = 0;  // used
  NodeId next = 0;
  for (NodeId& node : made.node_of_tag) {
    if (node == 0) node = next++;
  }
  std::vector<Vec3d> positions(static_cast<std::size_t>(next));
  for (std::size_t place = 0; place < tags.size(); ++place) {
    const NodeId node = made.node_of_tag[tags[place]];
    if (node < 0) continue;
    const double* const position = &coordinates[3 * place];
    positions[static_cast<std::size_t>(node)] = {position[0], position[1], position[2]};
  }
  std::vector<NodeId> nodes;
  nodes.reserve(corners.size());
  for (const std::size_t tag : corners) nodes.push_back(made.node_of_tag[tag]);
  made.mesh.positions = std::move(positions);
  made.mesh.blocks.push_back(
      {dimension == 2 ? ElementType::triangle : ElementType::tetrahedron, std::move(nodes)});
  return made;
}

}  // namespace

Mesh make_with_gmsh(const std::string& name, int dimension, const std::function<void()>& build,
                    const std::function<void(GmshMesh&)>& use) {
  GmshMesh made;
  GmshSession session;
  session.run("GENERATOR_FAILED", name, [&] {
    // One thread and one algorithm: the same mesh every time.
    gmsh::option::setNumber("General.NumThreads", 1);
    gmsh::option::setNumber("Mesh.Algorithm", 6);    // frontal Delaunay
    gmsh::option::setNumber("Mesh.Algorithm3D", 1);  // Delaunay
    gmsh::option::setNumber("Mesh.ElementOrder", 1);
    build();
    gmsh::model::mesh::generate(dimension);
    made = take_mesh(dimension);
    if (made.mesh.element_count() == 0) {
      throw Error("GENERATOR_FAILED", name + ": Gmsh made no elements");
    }
    use(made);
  });
  return std::move(made.mesh);
}

void for_each_node_of(const GmshMesh& mesh, int dimension, int entity,
                      const std::function<void(std::size_t)>& visit) {
  std::vector<std::size_t> tags;
  std::vector<double> coordinates;
  std::vector<double> parameters;
  gmsh::model::mesh::getNodes(tags, coordinates, parameters, dimension, entity, true);
  for (const std::size_t tag : tags) {
    if (mesh.node_of_tag[tag] >= 0) visit(static_cast<std::size_t>(mesh.node_of_tag[tag]));
  }
}

}  // namespace meshsmooth::formats

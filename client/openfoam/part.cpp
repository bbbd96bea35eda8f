#include "part.hpp"

#include <cellModel.H>
#include <cellShape.H>

namespace meshsmooth_foam {
namespace {

using Foam::cellModel;
using Foam::face;
using Foam::label;
using Foam::labelList;
using Foam::vector;

class Builder {
 public:
  Builder(const Foam::polyMesh& mesh, const Foam::pointField& points, Part& part)
      : mesh_(mesh), points_(points), part_(part), node_of_(mesh.nPoints(), -1) {}

  void add(int type, std::initializer_list<label> points, label origin) {
    for (const label point : points) elements(type).push_back(node_of(point));
    part_.elements[type].origins.push_back(origin);
  }

  /// False: it is none of the service's types.
  bool add_shape(const Foam::cellShape& shape, label cell) {
    const label model = shape.model().index();
    if (model == cellModel::HEX) {
      add(MESHSMOOTH_HEXAHEDRON,
          {shape[0], shape[1], shape[2], shape[3], shape[4], shape[5], shape[6], shape[7]}, cell);
    } else if (model == cellModel::PRISM) {  // whose first triangle looks inward, unlike VTK's
      add(MESHSMOOTH_WEDGE, {shape[0], shape[2], shape[1], shape[3], shape[5], shape[4]}, cell);
    } else if (model == cellModel::PYR) {
      add(MESHSMOOTH_PYRAMID, {shape[0], shape[1], shape[2], shape[3], shape[4]}, cell);
    } else if (model == cellModel::TET) {
      add(MESHSMOOTH_TETRAHEDRON, {shape[0], shape[1], shape[2], shape[3]}, cell);
    } else {
      return false;
    }
    return true;
  }

  void add_polyhedron(label cell) {
    const Foam::cell& faces = mesh_.cells()[cell];
    const std::int32_t apex = new_node(faces.centre(points_, mesh_.faces()));
    for (const label index : faces) {
      const face& outward = mesh_.faces()[index];
      const bool owns = mesh_.faceOwner()[index] == cell;
      const face inward = owns ? outward.reverseFace() : outward;
      if (inward.size() == 3 || inward.size() == 4) {
        add_fan(inward.size() == 3 ? MESHSMOOTH_TETRAHEDRON : MESHSMOOTH_PYRAMID, inward, apex,
                cell);
        continue;
      }
      const std::int32_t centre = face_centre(index);
      for (label corner = 0; corner < inward.size(); ++corner) {
        auto& nodes = elements(MESHSMOOTH_TETRAHEDRON);
        nodes.insert(nodes.end(),
                     {node_of(inward[corner]), node_of(inward.nextLabel(corner)), centre, apex});
        part_.elements[MESHSMOOTH_TETRAHEDRON].origins.push_back(cell);
      }
    }
  }

  void add_polygon(const face& polygon, label origin) {
    if (polygon.size() == 3) {
      add(MESHSMOOTH_TRIANGLE, {polygon[0], polygon[1], polygon[2]}, origin);
    } else if (polygon.size() == 4) {
      add(MESHSMOOTH_QUAD, {polygon[0], polygon[1], polygon[2], polygon[3]}, origin);
    } else {
      const std::int32_t centre = new_node(polygon.centre(points_));
      for (label corner = 0; corner < polygon.size(); ++corner) {
        auto& nodes = elements(MESHSMOOTH_TRIANGLE);
        nodes.insert(nodes.end(),
                     {node_of(polygon[corner]), node_of(polygon.nextLabel(corner)), centre});
        part_.elements[MESHSMOOTH_TRIANGLE].origins.push_back(origin);
      }
    }
  }

 private:
  std::vector<std::int32_t>& elements(int type) { return part_.elements[type].nodes; }

  void add_fan(int type, const face& base, std::int32_t apex, label cell) {
    for (const label point : base) elements(type).push_back(node_of(point));
    elements(type).push_back(apex);
    part_.elements[type].origins.push_back(cell);
  }

  std::int32_t new_node(const vector& at) {
    vector position = part_.axes & at;
    if (part_.plane) position.z() = 0;
    part_.positions.push_back(position);
    part_.points.push_back(-1);
    return static_cast<std::int32_t>(part_.positions.size() - 1);
  }

  std::int32_t node_of(label point) {
    label& node = node_of_[point];
    if (node < 0) {
      node = new_node(points_[point]);
      part_.points.back() = point;
    }
    return node;
  }

  std::int32_t face_centre(label index) {
    if (centre_of_.empty()) centre_of_.setSize(mesh_.nFaces(), -1);
    label& node = centre_of_[index];
    if (node < 0) {
      const face& points = mesh_.faces()[index];
      node = new_node(points.average(points_, points_));
      part_.centres.push_back(node);
      part_.centre_faces.push_back(points);
    }
    return node;
  }

  const Foam::polyMesh& mesh_;
  const Foam::pointField& points_;
  Part& part_;
  labelList node_of_;    // [points]
  labelList centre_of_;  // [faces], or empty
};

}  // namespace

Part cells_of(const Foam::polyMesh& mesh, const Foam::pointField& points) {
  Part part;
  Builder builder(mesh, points, part);
  const Foam::cellShapeList& shapes = mesh.cellShapes();
  for (label cell = 0; cell < mesh.nCells(); ++cell) {
    if (!builder.add_shape(shapes[cell], cell)) builder.add_polyhedron(cell);
  }
  return part;
}

Part plane_of(const Foam::polyMesh& mesh, const Foam::pointField& points, const labelList& faces,
              const vector& normal) {
  Part part;
  part.plane = true;
  part.kind = "face";
  // An axis that the normal is farthest from; of a normal along z it is x, so nothing is rounded.
  const label far = std::abs(normal.x()) <= std::abs(normal.y())
                        ? (std::abs(normal.x()) <= std::abs(normal.z()) ? 0 : 2)
                        : (std::abs(normal.y()) <= std::abs(normal.z()) ? 1 : 2);
  vector first = Foam::Zero;
  first[far] = 1;
  first -= (first & normal) * normal;
  first /= Foam::mag(first);
  part.axes = Foam::tensor(first, normal ^ first, normal);
  Builder builder(mesh, points, part);
  for (const label index : faces) {
    const face& points_of = mesh.faces()[index];
    const bool along = (points_of.areaNormal(points) & normal) > 0;
    builder.add_polygon(along ? points_of : points_of.reverseFace(), index);
  }
  return part;
}

}  // namespace meshsmooth_foam

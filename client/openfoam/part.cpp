#include "part.hpp"

#include <cellModel.H>
#include <cellShape.H>

#include <algorithm>

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

  /// False: it is none of the service's types. A cell of six quads, one of which is a triangle with
  /// a point amid a side, only looks like a hexahedron.
  bool add_shape(const Foam::cellShape& shape, label cell) {
    const Foam::cell& faces = mesh_.cells()[cell];
    if (!std::all_of(faces.begin(), faces.end(),
                     [this](label index) { return is_convex(mesh_.faces()[index]); })) {
      return false;
    }
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
    part_.divided = true;
    const Foam::cell& faces = mesh_.cells()[cell];
    const std::int32_t apex = new_node(-1 - cell);
    for (const label index : faces) {
      for (const face& base : pieces_of(mesh_.faces()[index])) {
        const bool owns = mesh_.faceOwner()[index] == cell;
        const face inward = owns ? base.reverseFace() : base;
        const int type = base.size() == 3 ? MESHSMOOTH_TETRAHEDRON : MESHSMOOTH_PYRAMID;
        for (const label point : inward) elements(type).push_back(node_of(point));
        elements(type).push_back(apex);
        part_.elements[type].origins.push_back(cell);
      }
    }
  }

  void add_polygon(const face& polygon, label origin) {
    part_.divided = part_.divided || !is_simple(polygon);
    for (const face& piece : pieces_of(polygon)) {
      const int type = piece.size() == 3 ? MESHSMOOTH_TRIANGLE : MESHSMOOTH_QUAD;
      for (const label point : piece) elements(type).push_back(node_of(point));
      part_.elements[type].origins.push_back(origin);
    }
  }

 private:
  std::vector<std::int32_t>& elements(int type) { return part_.elements[type].nodes; }

  /// Whether each corner turns the same way and none is straight.
  bool is_convex(const face& polygon) const {
    const vector normal = polygon.areaNormal(points_);
    for (label corner = 0; corner < polygon.size(); ++corner) {
      const vector& here = points_[polygon[corner]];
      const vector before = here - points_[polygon.prevLabel(corner)];
      const vector after = points_[polygon.nextLabel(corner)] - here;
      const double turn = (before ^ after) & normal;
      if (turn <= 1e-6 * Foam::mag(before) * Foam::mag(after) * Foam::mag(normal)) return false;
    }
    return true;
  }

  bool is_simple(const face& polygon) const {
    return polygon.size() == 3 || (polygon.size() == 4 && is_convex(polygon));
  }

  /// The face itself, or the triangles of a polygon, the same for both of its cells.
  Foam::faceList pieces_of(const face& polygon) {
    if (is_simple(polygon)) return Foam::faceList(1, polygon);
    Foam::faceList triangles(polygon.size() - 2);
    label count = 0;
    polygon.triangles(points_, count, triangles);
    return triangles;
  }

  std::int32_t new_node(label point) {
    part_.points.push_back(point);
    return static_cast<std::int32_t>(part_.points.size() - 1);
  }

  std::int32_t node_of(label point) {
    label& node = node_of_[point];
    if (node < 0) node = new_node(point);
    return node;
  }

  const Foam::polyMesh& mesh_;
  const Foam::pointField& points_;
  Part& part_;
  labelList node_of_;  // [points]
};

}  // namespace

Part cells_of(const Foam::polyMesh& mesh, const Foam::pointField& points) {
  Part part;
  Builder builder(mesh, points, part);
  const Foam::cellShapeList& shapes = mesh.cellShapes();
  for (label cell = 0; cell < mesh.nCells(); ++cell) {
    if (!builder.add_shape(shapes[cell], cell)) builder.add_polyhedron(cell);
  }
  part.positions = positions_of(part, mesh, points);
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
  part.positions = positions_of(part, mesh, points);
  return part;
}

std::vector<vector> positions_of(const Part& part, const Foam::polyMesh& mesh,
                                 const Foam::pointField& points) {
  std::vector<vector> positions;
  for (const label point : part.points) {
    const vector at =
        point >= 0 ? points[point] : mesh.cells()[-1 - point].centre(points, mesh.faces());
    positions.push_back(part.axes & at);
    if (part.plane) positions.back().z() = 0;
  }
  return positions;
}

}  // namespace meshsmooth_foam

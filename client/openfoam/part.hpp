#pragma once

#include <meshsmooth.h>
#include <pointField.H>
#include <polyMesh.H>
#include <tensor.H>

#include <array>
#include <cstdint>
#include <vector>

namespace meshsmooth_foam {

/// Elements of one type and the cells or faces of the mesh that they are made of.
struct Elements {
  std::vector<std::int32_t> nodes;
  std::vector<Foam::label> origins;
};

/// What moves in one go, as the service takes it: all cells, or faces that lie in a plane.
struct Part {
  Foam::tensor axes = Foam::tensor::I;  ///< Rows: the directions of the coordinates.
  bool plane = false;                   ///< The third coordinate of every node is 0.
  const char* kind = "cell";            ///< What `origins` count.
  std::vector<Foam::vector> positions;  ///< [nodes], at rest.
  std::vector<Foam::label> points;      ///< [nodes], of the mesh; -1 - CELL: its centre.
  std::array<Elements, 7> elements;     ///< By MESHSMOOTH_TRIANGLE to _HEXAHEDRON.
  bool divided = false;                 ///< There are polyhedra or polygons.
};

/// The cells. Polyhedra are divided about their centres into pyramids and tetrahedra; faces of five
/// points or more, or that are not convex, are cut into triangles, as OpenFOAM does it. O(cells).
[[nodiscard]] Part cells_of(const Foam::polyMesh& mesh, const Foam::pointField& points);

/// Faces in a plane whose normal, of length 1, is `normal`; polygons are cut into triangles.
/// O(faces + points of the mesh).
[[nodiscard]] Part plane_of(const Foam::polyMesh& mesh, const Foam::pointField& points,
                            const Foam::labelList& faces, const Foam::vector& normal);

/// The nodes of a part where the points of the mesh are these.
[[nodiscard]] std::vector<Foam::vector> positions_of(const Part& part, const Foam::polyMesh& mesh,
                                                     const Foam::pointField& points);

}  // namespace meshsmooth_foam

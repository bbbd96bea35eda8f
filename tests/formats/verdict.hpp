#pragma once

// Random elements, and VTK's Verdict to measure them.

#include <vtkCell.h>
#include <vtkCellType.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>
#include <vtkVersion.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "meshsmooth/element.hpp"
#include "support/meshes.hpp"

#if VTK_VERSION_NUMBER < VTK_VERSION_CHECK(9, 2, 0)
using VerdictNodes = double (*)[3];
#else
using VerdictNodes = const double (*)[3];
#endif

namespace meshsmooth::test {

using Nodes = std::vector<Vec3d>;

/// Ideal elements with every node thrown about: most are valid, some very flat
/// or inverted. Surface elements stay plane.
class RandomElements {
 public:
  explicit RandomElements(ElementType type)
      : RandomElements(type, element_shape(type).dimension == 2 ? 0.6 : 0.35) {}
  /// Nodes are thrown by up to `size` along each axis.
  RandomElements(ElementType type, double size)
      : type_(type), is_surface_(element_shape(type).dimension == 2), noise_(-size, size) {}
  Nodes next() {
    Nodes nodes = ideal_points(type_);
    for (Vec3d& node : nodes) {
      node += next_vector();
      if (is_surface_) node.z = 0;
      node = 3.7 * node;
    }
    return nodes;
  }
  /// The ideal element stretched and sheared: its quads stay plane.
  Nodes next_affine() {
    const Vec3d x = Vec3d{1, 0, 0} + next_vector();
    const Vec3d y = Vec3d{0, 1, 0} + next_vector();
    const Vec3d z = Vec3d{0, 0, 1} + next_vector();
    Nodes nodes = ideal_points(type_);
    for (Vec3d& node : nodes) node = node.x * x + node.y * y + node.z * z;
    return nodes;
  }

 private:
  Vec3d next_vector() {
    const double x = noise_(random_);
    const double y = noise_(random_);
    return {x, y, noise_(random_)};
  }

  ElementType type_;
  bool is_surface_;
  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> noise_;
};

/// One of vtkMeshQuality's functions on one cell.
inline double verdict(double (*metric)(vtkCell*), int cell_type, const Nodes& nodes) {
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const vtkNew<vtkIdList> cell;
  for (const Vec3d& node : nodes)
    cell->InsertNextId(points->InsertNextPoint(node.x, node.y, node.z));
  const vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points);
  grid->InsertNextCell(cell_type, cell);
  return metric(grid->GetCell(0));
}

/// A function of Verdict itself, nodes in the given order.
template <std::size_t count>
double verdict(double (*metric)(int, VerdictNodes), const std::array<std::size_t, count>& order,
               const Nodes& nodes) {
  std::array<double[3], count> places;
  for (std::size_t node = 0; node < count; ++node) {
    const Vec3d place = nodes[order[node]];
    places[node][0] = place.x;
    places[node][1] = place.y;
    places[node][2] = place.z;
  }
  return metric(static_cast<int>(count), places.data());
}

// Verdict's first triangle of a wedge looks inward.
inline constexpr std::array<std::size_t, 6> kWedgeOrder = {0, 2, 1, 3, 5, 4};

}  // namespace meshsmooth::test

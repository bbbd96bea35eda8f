// WindowedSinc against VTK's filter.

#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkVersion.h>
#include <vtkWindowedSincPolyDataFilter.h>

#include <algorithm>
#include <vector>

#include "meshsmooth/smoother.hpp"
#include "support/meshes.hpp"

namespace meshsmooth {
namespace {

vtkNew<vtkPolyData> to_vtk(const Mesh& mesh) {
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vec3d& p : test::points(mesh)) points->InsertNextPoint(p.x, p.y, p.z);
  data->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  for (const ElementBlock& block : mesh.blocks) {
    const auto width = element_width(block.type);
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      cells->InsertNextCell(static_cast<int>(width));
      for (std::size_t n = at; n < at + width; ++n) cells->InsertCellPoint(block.nodes[n]);
    }
  }
  data->SetPolys(cells);
  return data;
}

/// False where this VTK has another window only: Hamming's before 9.4.
bool set_window(vtkWindowedSincPolyDataFilter& filter, Window window) {
#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 4, 0)
  filter.SetWindowFunction(window == Window::hamming ? vtkWindowedSincPolyDataFilter::HAMMING
                                                     : vtkWindowedSincPolyDataFilter::NUTTALL);
  return true;
#else
  (void)filter;
  return window == Window::hamming;
#endif
}

/// A graph over the plane, away from the origin; its boundary is open.
Mesh wavy(ElementType type) {
  return test::noisy(
      test::mapped(test::lattice(type, 12),
                   [](Vec3d p) {
                     return Vec3d{p.x + 5, p.y - 3, 2 + std::sin(0.5 * p.x) * std::cos(0.4 * p.y)};
                   }),
      0.1, 7);
}

TEST(WindowedSinc, IsVtksToAMillionthOfTheBox) {
  const std::vector<std::pair<std::string, Mesh>> meshes = {
      {"sphere", test::noisy(test::sphere(4), 0.01, 3)},
      {"triangles", wavy(ElementType::triangle)},
      {"quads", wavy(ElementType::quad)}};
  for (const auto& [name, mesh] : meshes) {
    for (const Window window : {Window::nuttall, Window::hamming}) {
      for (const double pass_band : {0.03, 0.1, 0.5}) {
        for (const int terms : {20, 50}) {
          vtkNew<vtkWindowedSincPolyDataFilter> filter;
          if (!set_window(*filter, window)) continue;
          filter->SetInputData(to_vtk(mesh));
          filter->SetNumberOfIterations(terms);
          filter->SetPassBand(pass_band);
          filter->SetBoundarySmoothing(false);
          filter->SetFeatureEdgeSmoothing(false);
          filter->SetNormalizeCoordinates(true);
          filter->Update();
          Mesh ours = mesh;
          const SmoothSummary summary = make_smoother("cpu")->smooth(
              ours,
              {.method = WindowedSinc{window, pass_band}, .max_iterations = terms, .guard = false});

          double farthest = 0, moved = 0;
          for (std::size_t n = 0; n < mesh.node_count(); ++n) {
            const Vec3d own = test::points(ours)[n];
            // A node of the boundary stays; VTK 9.7 moves it with the size of the mesh.
            if (own == test::points(mesh)[n]) continue;
            double p[3];
            filter->GetOutput()->GetPoint(static_cast<vtkIdType>(n), p);
            farthest = std::max(farthest, norm(own - Vec3d{p[0], p[1], p[2]}));
            ++moved;
          }
          const double diagonal = summary.convergence.bounding_box_diagonal;
          EXPECT_LT(farthest, 1e-6 * diagonal)
              << name << ", pass band " << pass_band << ", " << terms;
          EXPECT_EQ(moved, summary.nodes.total - summary.nodes.fixed);
        }
      }
    }
  }
}

}  // namespace
}  // namespace meshsmooth

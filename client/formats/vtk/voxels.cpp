#include "vtk/voxels.hpp"

#include <vtkCellArray.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "vtk/number_text.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

std::vector<bool> moved_nodes(const Positions& read, const PositionsView& now) {
  std::vector<bool> moved;
  std::visit(
      [&](const auto& before, const auto& after) {
        for (std::size_t node = 0; node < before.size(); ++node) {
          const auto a = vec3_cast<double>(before[node]);
          const auto b = vec3_cast<double>(after[node]);
          moved.push_back(!same_number(a.x, b.x) || !same_number(a.y, b.y) ||
                          !same_number(a.z, b.z));
        }
      },
      read, now);
  return moved;
}

}  // namespace

std::vector<std::int64_t> voxels_to_turn(const VtkDataset& dataset, const Mesh& mesh, bool all) {
  std::vector<std::int64_t> cells;
  if (!dataset.has_voxels()) return cells;
  const auto moved = moved_nodes(dataset.positions(), mesh.positions_view());
  const vtkNew<vtkIdList> nodes;
  for (vtkIdType cell = 0; cell < dataset.data()->GetNumberOfCells(); ++cell) {
    dataset.data()->GetCellPoints(cell, nodes);
    const auto count = static_cast<std::size_t>(nodes->GetNumberOfIds());
    if (!is_voxel(dataset.data()->GetCellType(cell), count)) continue;
    const bool turned = all || std::any_of(nodes->begin(), nodes->end(), [&](vtkIdType node) {
                          return node >= 0 && static_cast<std::size_t>(node) < moved.size() &&
                                 moved[static_cast<std::size_t>(node)];
                        });
    if (turned) cells.push_back(cell);
  }
  return cells;
}

void turn_voxels(vtkPointSet& dataset, const std::vector<std::int64_t>& turned) {
  auto* grid = vtkUnstructuredGrid::SafeDownCast(&dataset);
  if (grid == nullptr || turned.empty()) return;
  const vtkNew<vtkCellArray> cells;
  cells->DeepCopy(grid->GetCells());
  const vtkNew<vtkUnsignedCharArray> types;
  types->DeepCopy(grid->GetCellTypesArray());
  const vtkNew<vtkIdList> nodes;
  for (const std::int64_t cell : turned) {
    cells->GetCellAtId(cell, nodes);
    const auto count = static_cast<std::size_t>(nodes->GetNumberOfIds());
    const int type = turn_voxel(std::span(nodes->GetPointer(0), count));
    cells->ReplaceCellAtId(cell, nodes);
    types->SetValue(cell, static_cast<unsigned char>(type));
  }
  grid->SetCells(types, cells, grid->GetFaceLocations(), grid->GetFaces());
}

}  // namespace meshsmooth::formats

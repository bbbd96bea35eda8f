#include "vtk_content.hpp"

#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkIdList.h>
#include <vtkIntArray.h>
#include <vtkLongLongArray.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>
#include <vtkVariant.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <sstream>

#include "vtk/layout.hpp"
#include "vtk/stored_arrays.hpp"
#include "vtk/voxels.hpp"

namespace meshsmooth::formats {
namespace {

template <class Real>
std::vector<Vec3<Real>> copy_positions(vtkPoints* points) {
  std::vector<Vec3<Real>> positions(static_cast<std::size_t>(points->GetNumberOfPoints()));
  for (std::size_t node = 0; node < positions.size(); ++node) {
    std::array<double, 3> place{};
    points->GetPoint(static_cast<vtkIdType>(node), place.data());
    positions[node] = vec3_cast<Real>(Vec3d{place[0], place[1], place[2]});
  }
  return positions;
}

/// None for an array that is not of one number each.
std::optional<Column> column_of(vtkDataArray* array) {
  if (array == nullptr || array->GetNumberOfComponents() != 1) return std::nullopt;
  Column column{array->GetName() == nullptr ? "" : array->GetName(),
                array->GetDataType() != VTK_FLOAT && array->GetDataType() != VTK_DOUBLE,
                {}};
  column.values.reserve(static_cast<std::size_t>(array->GetNumberOfTuples()));
  for (vtkIdType row = 0; row < array->GetNumberOfTuples(); ++row) {
    column.values.push_back(array->GetTuple1(row));
  }
  return column;
}

std::vector<Column> columns_of(vtkFieldData* data) {
  std::vector<Column> columns;
  for (int index = 0; index < data->GetNumberOfArrays(); ++index) {
    if (auto column = column_of(data->GetArray(index))) columns.push_back(std::move(*column));
  }
  return columns;
}

template <class Array>
void add_array(vtkFieldData* data, const Column& column) {
  const vtkNew<Array> array;
  array->SetName(column.name.c_str());
  for (const double value : column.values) {
    array->InsertNextValue(static_cast<typename Array::ValueType>(value));
  }
  data->AddArray(array);
}

/// Ids may be large.
bool needs_long(const Column& column) {
  constexpr double kLimit = std::numeric_limits<int>::max();
  return column.name == kNodeIdArray || column.name == kElementIdArray ||
         std::ranges::any_of(column.values, [](double value) { return std::abs(value) > kLimit; });
}

void add_arrays(vtkFieldData* data, const std::vector<Column>& columns,
                std::span<const Table> tables) {
  for (const Column& column : columns) {
    if (!column.whole) {
      add_array<vtkDoubleArray>(data, column);
    } else if (needs_long(column)) {
      add_array<vtkLongLongArray>(data, column);
    } else {
      add_array<vtkIntArray>(data, column);
    }
  }
  for (const Table& table : tables) {
    const vtkNew<vtkDoubleArray> array;
    array->SetName(table.name.c_str());
    array->SetNumberOfComponents(static_cast<int>(table.components));
    array->SetNumberOfTuples(static_cast<vtkIdType>(table.values.size() / table.components));
    std::ranges::copy(table.values, array->GetPointer(0));
    data->AddArray(array);
  }
}

vtkSmartPointer<vtkUnstructuredGrid> grid_of_cells(vtkPointSet* source) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->Allocate(source->GetNumberOfCells());
  const vtkNew<vtkIdList> cell;
  for (vtkIdType id = 0; id < source->GetNumberOfCells(); ++id) {
    source->GetCellPoints(id, cell);
    grid->InsertNextCell(source->GetCellType(id), cell);
  }
  grid->GetPointData()->ShallowCopy(source->GetPointData());
  grid->GetCellData()->ShallowCopy(source->GetCellData());
  grid->GetFieldData()->ShallowCopy(source->GetFieldData());
  return grid;
}

/// Without points.
vtkSmartPointer<vtkUnstructuredGrid> grid_of(const Dataset& dataset) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->Allocate(dataset.cell_count());
  Cell cell;
  const vtkNew<vtkIdList> nodes;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    nodes->Reset();
    for (const std::int64_t node : cell.nodes) nodes->InsertNextId(node);
    // What VTK has no type for keeps its nodes.
    grid->InsertNextCell(cell.type < kFirstOwnCellType ? cell.type : kPolyVertexCell, nodes);
  }
  add_arrays(grid->GetPointData(), dataset.node_columns(), dataset.node_tables());
  add_arrays(grid->GetCellData(), dataset.cell_columns(), dataset.cell_tables());
  return grid;
}

void add_cell_array(vtkPointSet& data, const MeshFile& file, std::string_view name,
                    std::span<const float> values) {
  const vtkNew<vtkFloatArray> array;
  array->SetName(std::string(name).c_str());
  array->SetNumberOfValues(data.GetNumberOfCells());
  array->FillValue(std::numeric_limits<float>::quiet_NaN());
  for (std::size_t e = 0; e < values.size(); ++e) {
    const auto cell =
        file.content() ? file.content()->element_cells.at(e) : static_cast<std::int64_t>(e);
    array->SetValue(cell, values[e]);
  }
  data.GetCellData()->AddArray(array);
}

void add_element_arrays(vtkPointSet& data, const MeshFile& file) {
  const ElementQualityArrays& quality = file.element_quality;
  for (std::size_t m = 0; m < quality.metrics.size(); ++m) {
    add_cell_array(data, file, metric_name(quality.metrics[m]), quality.of(m));
  }
  for (const ElementArray& array : file.element_arrays) {
    add_cell_array(data, file, array.name, array.values);
  }
}

const VtkDataset* vtk_dataset_of(const MeshFile& file) {
  return file.content() ? dynamic_cast<const VtkDataset*>(file.content()->dataset.get()) : nullptr;
}

}  // namespace

VtkDataset::VtkDataset(vtkSmartPointer<vtkPointSet> data, std::shared_ptr<const VtkLayout> layout)
    : data_(std::move(data)), layout_(std::move(layout)) {
  for (vtkIdType cell = 0; cell < data_->GetNumberOfCells() && !has_voxels_; ++cell) {
    const int type = data_->GetCellType(cell);
    has_voxels_ = type == kPixelCell || type == kVoxelCell;
  }
}

std::int64_t VtkDataset::node_count() const { return data_->GetNumberOfPoints(); }

std::int64_t VtkDataset::cell_count() const { return data_->GetNumberOfCells(); }

void VtkDataset::get_cell(std::int64_t id, Cell& cell) const {
  data_->GetCellPoints(id, nodes_);
  cell.type = data_->GetCellType(id);
  cell.nodes.assign(nodes_->begin(), nodes_->end());
  if (is_voxel(cell.type, cell.nodes.size())) cell.type = turn_voxel(std::span(cell.nodes));
}

Positions VtkDataset::positions() const {
  if (data_->GetPoints()->GetDataType() == VTK_FLOAT) {
    return copy_positions<float>(data_->GetPoints());
  }
  return copy_positions<double>(data_->GetPoints());
}

std::vector<Column> VtkDataset::node_columns() const { return columns_of(data_->GetPointData()); }

std::vector<Column> VtkDataset::cell_columns() const { return columns_of(data_->GetCellData()); }

std::optional<Column> VtkDataset::node_column(const std::string& name) const {
  return column_of(data_->GetPointData()->GetArray(name.c_str()));
}

std::optional<std::vector<Vec3d>> VtkDataset::node_vectors(const std::string& name) const {
  vtkDataArray* const array = data_->GetPointData()->GetArray(name.c_str());
  if (array == nullptr || array->GetNumberOfComponents() != 3) return std::nullopt;
  std::vector<Vec3d> vectors;
  vectors.reserve(static_cast<std::size_t>(array->GetNumberOfTuples()));
  for (vtkIdType row = 0; row < array->GetNumberOfTuples(); ++row) {
    const double* const v = array->GetTuple3(row);
    vectors.push_back({v[0], v[1], v[2]});
  }
  return vectors;
}

std::optional<Column> VtkDataset::cell_column(const std::string& name) const {
  return column_of(data_->GetCellData()->GetArray(name.c_str()));
}

std::vector<StoredArray> VtkDataset::stored_arrays() const { return stored_arrays_of(*data_); }

std::string VtkDataset::vtk_cell_name(int type) {
  const std::string class_name = vtkCellTypes::GetClassNameFromTypeId(type);
  const std::string number = "VTK cell type " + std::to_string(type);
  if (class_name == "UnknownClass") return number;
  std::string words;  // "vtkQuadraticTetra" -> "quadratic tetra"
  for (const char letter : class_name.substr(class_name.starts_with("vtk") ? 3 : 0)) {
    const auto code = static_cast<unsigned char>(letter);
    if (std::isupper(code) && !words.empty()) words += ' ';
    words += static_cast<char>(std::tolower(code));
  }
  return words + " (" + number + ")";
}

std::vector<PhysicalName> physical_names(vtkFieldData* data) {
  auto* rows = vtkStringArray::SafeDownCast(data->GetAbstractArray(kPhysicalNamesArray));
  std::vector<PhysicalName> names;
  for (vtkIdType row = 0; rows != nullptr && row < rows->GetNumberOfValues(); ++row) {
    std::istringstream words(rows->GetValue(row));
    PhysicalName group;
    words >> group.dimension >> group.tag >> std::ws;
    std::getline(words, group.name);
    names.push_back(std::move(group));
  }
  return names;
}

void add_physical_names(vtkFieldData* data, const std::vector<PhysicalName>& names) {
  const vtkNew<vtkStringArray> array;
  array->SetName(kPhysicalNamesArray);
  for (const PhysicalName& group : names) {
    array->InsertNextValue(std::to_string(group.dimension) + ' ' + std::to_string(group.tag) + ' ' +
                           group.name);
  }
  data->AddArray(array);
}

vtkSmartPointer<vtkPoints> make_points(const PositionsView& positions) {
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(std::holds_alternative<std::span<const Vec3f>>(positions) ? VTK_FLOAT
                                                                                : VTK_DOUBLE);
  points->SetNumberOfPoints(static_cast<vtkIdType>(position_count(positions)));
  std::visit(
      [&](const auto& nodes) {
        for (std::size_t node = 0; node < nodes.size(); ++node) {
          const auto place = vec3_cast<double>(nodes[node]);
          points->SetPoint(static_cast<vtkIdType>(node), place.x, place.y, place.z);
        }
      },
      positions);
  return points;
}

vtkSmartPointer<vtkPointSet> moved_dataset(const MeshFile& file, Voxels voxels) {
  const VtkDataset* own = vtk_dataset_of(file);
  if (own == nullptr) return moved_grid(file, voxels);
  auto dataset = vtkSmartPointer<vtkPointSet>::Take(own->data()->NewInstance());
  dataset->ShallowCopy(own->data());
  turn_voxels(*dataset, voxels_to_turn(*own, file.mesh, voxels == Voxels::turn_all));
  dataset->SetPoints(make_points(file.mesh.positions_view()));
  add_element_arrays(*dataset, file);
  return dataset;
}

vtkSmartPointer<vtkUnstructuredGrid> moved_grid(const MeshFile& file, Voxels voxels) {
  vtkSmartPointer<vtkUnstructuredGrid> grid;
  if (vtk_dataset_of(file) == nullptr) {
    grid = grid_of(*dataset_of(file));
    if (file.content() && !file.content()->physical_names.empty()) {
      add_physical_names(grid->GetFieldData(), file.content()->physical_names);
    }
    add_element_arrays(*grid, file);
  } else {
    const auto dataset = moved_dataset(file, voxels);
    grid = vtkUnstructuredGrid::SafeDownCast(dataset);
    if (!grid) grid = grid_of_cells(dataset);
  }
  grid->SetPoints(make_points(file.mesh.positions_view()));
  return grid;
}

}  // namespace meshsmooth::formats

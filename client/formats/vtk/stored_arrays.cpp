#include "vtk/stored_arrays.hpp"

#include <vtkCellData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkVariant.h>

#include <string>

namespace meshsmooth::formats {
namespace {

/// Of any array: numbers as they are in memory, all else as text, each value with its length.
StoredArray stored(const std::string& place, vtkAbstractArray* array) {
  StoredArray result;
  result.name = place + " " + (array->GetName() == nullptr ? "" : array->GetName());
  result.type = std::string(array->GetDataTypeAsString()) + " x " +
                std::to_string(array->GetNumberOfComponents());
  const vtkIdType count = array->GetNumberOfValues();
  if (auto* numbers = vtkDataArray::SafeDownCast(array); numbers != nullptr) {
    if (numbers->GetDataType() != VTK_BIT && numbers->HasStandardMemoryLayout()) {
      result.bytes.assign(static_cast<const char*>(numbers->GetVoidPointer(0)),
                          static_cast<std::size_t>(count * numbers->GetDataTypeSize()));
      return result;
    }
  }
  for (vtkIdType index = 0; index < count; ++index) {
    const std::string value = array->GetVariantValue(index).ToString();
    result.bytes += std::to_string(value.size()) + ':' + value;
  }
  return result;
}

void add_stored(std::vector<StoredArray>& arrays, const std::string& place, vtkFieldData* data) {
  for (int index = 0; index < data->GetNumberOfArrays(); ++index) {
    arrays.push_back(stored(place, data->GetAbstractArray(index)));
  }
}

}  // namespace

std::vector<StoredArray> stored_arrays_of(vtkPointSet& data) {
  std::vector<StoredArray> arrays;
  add_stored(arrays, "point array", data.GetPointData());
  add_stored(arrays, "cell array", data.GetCellData());
  add_stored(arrays, "field array", data.GetFieldData());
  if (auto* grid = vtkUnstructuredGrid::SafeDownCast(&data); grid && grid->GetFaces() != nullptr) {
    StoredArray faces{"faces of polyhedra", "ids", {}};
    const vtkNew<vtkIdList> stream;
    for (vtkIdType cell = 0; cell < grid->GetNumberOfCells(); ++cell) {
      if (grid->GetCellType(cell) != kPolyhedronCell) continue;
      grid->GetFaceStream(cell, stream);
      faces.bytes.append(reinterpret_cast<const char*>(stream->GetPointer(0)),
                         static_cast<std::size_t>(stream->GetNumberOfIds()) * sizeof(vtkIdType));
    }
    if (!faces.bytes.empty()) arrays.push_back(std::move(faces));
  }
  return arrays;
}

}  // namespace meshsmooth::formats

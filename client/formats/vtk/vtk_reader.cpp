#include <vtkCellData.h>
#include <vtkDataSetReader.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <limits>
#include <string>
#include <string_view>

#include "readers.hpp"
#include "text.hpp"
#include "vtk/captured_errors.hpp"
#include "vtk/in_place.hpp"
#include "vtk/layout.hpp"
#include "vtk/polyhedron_faces.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

template <class Reader>
vtkSmartPointer<vtkDataObject> run_reader(const std::filesystem::path& path) {
  const vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> run_legacy_reader(const std::filesystem::path& path,
                                                 const VtkLayout& layout) {
  const vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(path.c_str());
  if (layout.readable) {
    if (layout.readable->size() > std::numeric_limits<int>::max()) {
      fail("FORMAT_ERROR", path, "it has numbers like nan, and is too long to be read with them");
    }
    reader->ReadFromInputStringOn();
    reader->SetInputString(*layout.readable);
  }
  // Without these a legacy reader keeps only the first array of each kind.
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllColorScalarsOn();
  reader->ReadAllTCoordsOn();
  reader->ReadAllFieldsOn();
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> run_reader_of(const std::filesystem::path& path,
                                             const VtkLayout& layout) {
  const std::string extension = extension_of(path);
  if (extension == ".vtu") return run_reader<vtkXMLUnstructuredGridReader>(path);
  if (extension == ".vtp") return run_reader<vtkXMLPolyDataReader>(path);
  return run_legacy_reader(path, layout);
}

/// VTK's readers may crash or see an empty mesh in a file of another kind, and say nothing of a
/// file that was cut off.
VtkLayout scan(const std::filesystem::path& path, std::string_view bytes) {
  if (extension_of(path) == ".vtk") return scan_legacy(path, bytes);
  if (bytes.find("<VTKFile") == std::string_view::npos) {
    fail("FORMAT_ERROR", path, "this is no VTK XML file");
  }
  const std::size_t last = bytes.find_last_not_of(" \t\r\n");
  if (!bytes.substr(0, last + 1).ends_with("</VTKFile>")) {
    fail("FILE_TRUNCATED", path, "there is no </VTKFile> at its end");
  }
  return scan_xml(path, bytes);
}

template <class Array>
void restore_numbers(vtkAbstractArray* data) {
  auto* const array = Array::SafeDownCast(data);
  if (array == nullptr) return;
  using Real = typename Array::ValueType;
  constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
  for (vtkIdType place = 0; place < array->GetNumberOfValues(); ++place) {
    const Real value = array->GetValue(place);
    if (value == Real(kInsteadOfNan)) {
      array->SetValue(place, std::numeric_limits<Real>::quiet_NaN());
    } else if (value == Real(kInsteadOfInfinity)) {
      array->SetValue(place, kInfinity);
    } else if (value == Real(kInsteadOfMinusInfinity)) {
      array->SetValue(place, -kInfinity);
    }
  }
}

/// Puts NaN and infinity where VTK has read numbers instead.
void restore_numbers(vtkPointSet& dataset) {
  const auto restore = [](vtkAbstractArray* array) {
    restore_numbers<vtkFloatArray>(array);
    restore_numbers<vtkDoubleArray>(array);
  };
  for (vtkFieldData* data :
       {static_cast<vtkFieldData*>(dataset.GetPointData()),
        static_cast<vtkFieldData*>(dataset.GetCellData()), dataset.GetFieldData()}) {
    for (int array = 0; array < data->GetNumberOfArrays(); ++array) {
      restore(data->GetAbstractArray(array));
    }
  }
  if (dataset.GetPoints() != nullptr) restore(dataset.GetPoints()->GetData());
}

/// The arrays must be as long as the data set says: a reader that met the end
/// of the file leaves them short or unset.
void check_arrays(const std::filesystem::path& path, vtkPointSet& dataset) {
  const auto check = [&](vtkFieldData* data, vtkIdType expected) {
    for (int index = 0; index < data->GetNumberOfArrays(); ++index) {
      const vtkAbstractArray* array = data->GetAbstractArray(index);
      if (array->GetNumberOfTuples() != expected) {
        const std::string name =
            data->GetArrayName(index) == nullptr ? "" : data->GetArrayName(index);
        fail("FILE_TRUNCATED", path,
             "data array \"" + name + "\" has " + std::to_string(array->GetNumberOfTuples()) +
                 " values for " + std::to_string(expected) + " nodes or elements");
      }
    }
  };
  check(dataset.GetPointData(), dataset.GetNumberOfPoints());
  check(dataset.GetCellData(), dataset.GetNumberOfCells());
}

/// A library that drops something must not do so in silence.
void check_counts(const std::filesystem::path& path, const VtkLayout& layout,
                  vtkPointSet& dataset) {
  const auto check = [&](const char* what, std::size_t announced, vtkIdType found) {
    if (announced == static_cast<std::size_t>(found)) return;
    fail("FORMAT_ERROR", path,
         "it announces " + std::to_string(announced) + ' ' + what + ", VTK finds " +
             std::to_string(found) + " in it");
  };
  check("points", layout.node_count(), dataset.GetNumberOfPoints());
  check("cells", layout.cell_count(), dataset.GetNumberOfCells());
}

vtkSmartPointer<vtkPointSet> read_dataset(const std::filesystem::path& path, std::string_view bytes,
                                          const VtkLayout& layout) {
  const CapturedErrors errors;
  const auto data = run_reader_of(path, layout);
  if (const std::string what = errors.first(); !what.empty()) {
    fail("FORMAT_ERROR", path, "VTK cannot read it: " + what);
  }
  vtkSmartPointer<vtkPointSet> dataset = vtkPointSet::SafeDownCast(data);
  if (!dataset) fail("FORMAT_ERROR", path, "VTK finds no mesh in it");
  if (layout.readable) restore_numbers(*dataset);
  check_counts(path, layout, *dataset);
  check_arrays(path, *dataset);
  auto* const grid = vtkUnstructuredGrid::SafeDownCast(dataset);
  if (grid != nullptr && !add_faces(bytes, layout, *grid)) {
    fail("FORMAT_ERROR", path, "the faces of its polyhedra are damaged");
  }
  return dataset;
}

}  // namespace

MeshFile read_vtk(const std::filesystem::path& path) {
  FileContent content;
  content.extension = extension_of(path);
  content.text = read_bytes(path);
  const auto layout = std::make_shared<VtkLayout>(scan(path, content.text));
  const auto data = read_dataset(path, content.text, *layout);
  const auto dataset = std::make_shared<VtkDataset>(data, layout);
  layout->readable.reset();
  {
    const CapturedErrors quiet;
    layout->in_place = agrees(content.text, *layout, *dataset);
  }
  content.dataset = dataset;
  for (const PhysicalName& group : physical_names(data->GetFieldData())) {
    content.groups.push_back({group.dimension, group.called(), kPhysicalArray, {group.tag}});
  }
  return make_mesh_file(path, std::move(content));
}

}  // namespace meshsmooth::formats

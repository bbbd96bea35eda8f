#include <vtkCellData.h>
#include <vtkDataSetReader.h>
#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkSTLReader.h>
#include <vtkSTLWriter.h>
#include <vtkUnstructuredGridWriter.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "cells.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

/// While it lives, it captures VTK's error messages, which otherwise go to the terminal. VTK's
/// readers report an error and carry on; the first one counts.
class ComplaintWindow : public vtkOutputWindow {
 public:
  static ComplaintWindow* New();
  vtkTypeMacro(ComplaintWindow, vtkOutputWindow) void DisplayText(const char* text) override {
    note(text);
  }
  void DisplayErrorText(const char* text) override { note(text); }
  void DisplayWarningText(const char* text) override { note_if_serious(text); }
  void DisplayGenericWarningText(const char* text) override { note_if_serious(text); }
  void DisplayDebugText(const char*) override {}

  std::string first;

 private:
  // Some readers only warn of a file that ends too early.
  void note_if_serious(const char* text) {
    if (text != nullptr && std::string_view(text).find("rror") != std::string_view::npos)
      note(text);
  }
  void note(const char* text) {
    if (first.empty() && text != nullptr) first = text;
  }
};
vtkStandardNewMacro(ComplaintWindow);

class CapturedErrors {
 public:
  CapturedErrors() : before_(vtkOutputWindow::GetInstance()) {
    vtkOutputWindow::SetInstance(window_);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  }
  ~CapturedErrors() {
    vtkLogger::SetStderrVerbosity(verbosity_before_);
    vtkOutputWindow::SetInstance(before_);
  }
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;

  /// The first one in one line, without VTK's source file and address; or "".
  [[nodiscard]] std::string first() const {
    std::string text = window_->first;
    std::replace(text.begin(), text.end(), '\n', ' ');
    for (const char* sign : {"): ", ".cxx, line "}) {
      if (const auto place = text.find(sign); place != std::string::npos) {
        text.erase(0, place + std::string_view(sign).size());
      }
    }
    text.erase(text.find_last_not_of(" \t\r") + 1);
    return text;
  }

 private:
  vtkNew<ComplaintWindow> window_;
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_before_ = vtkLogger::GetCurrentVerbosityCutoff();
};

template <class Reader>
vtkSmartPointer<vtkDataObject> run_reader(const std::filesystem::path& path) {
  const vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

vtkSmartPointer<vtkDataObject> run_legacy_reader(const std::filesystem::path& path) {
  const vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(path.c_str());
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

vtkSmartPointer<vtkDataObject> run_reader_of(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension == ".vtu") return run_reader<vtkXMLUnstructuredGridReader>(path);
  if (extension == ".vtp") return run_reader<vtkXMLPolyDataReader>(path);
  if (extension == ".stl") return run_reader<vtkSTLReader>(path);
  return run_legacy_reader(path);
}

/// VTK's readers of these formats may crash or see an empty mesh in a file of
/// another kind, and say nothing of a file that was cut off.
void check_signature(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  const std::string bytes = read_bytes(path);
  const auto refuse = [&](const char* kind) {
    fail("FORMAT_ERROR", path, std::string("this is no ") + kind + " file");
  };
  if (extension == ".vtu" || extension == ".vtp") {
    const std::size_t last = bytes.find_last_not_of(" \t\r\n");
    if (bytes.find("<VTKFile") == std::string::npos) refuse("VTK XML");
    if (!std::string_view(bytes).substr(0, last + 1).ends_with("</VTKFile>")) {
      fail("FILE_TRUNCATED", path, "there is no </VTKFile> at its end");
    }
  } else if (extension == ".vtk") {
    if (!bytes.starts_with("# vtk DataFile Version")) refuse("legacy VTK");
  } else if (extension == ".stl") {
    std::uint32_t triangles = 0;
    if (bytes.size() >= 84) std::copy_n(bytes.data() + 80, 4, reinterpret_cast<char*>(&triangles));
    const bool text = bytes.starts_with("solid") && bytes.find("facet") != std::string::npos;
    const std::size_t expected = 84 + std::size_t{50} * triangles;
    if (text && bytes.size() != expected) {
      if (bytes.find("endsolid") == std::string::npos) {
        fail("FILE_TRUNCATED", path, "there is no endsolid");
      }
    } else if (bytes.size() < 84 || bytes.size() > expected + 4096) {
      refuse("STL");
    } else if (bytes.size() < expected) {
      fail("FILE_TRUNCATED", path,
           "it should hold " + std::to_string(triangles) + " triangles, " +
               std::to_string(expected) + " bytes, but has " + std::to_string(bytes.size()));
    }
  }
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

template <class Writer, class Data>
bool run_writer(Writer* writer, Data* data, const std::filesystem::path& path) {
  writer->SetFileName(path.c_str());
  writer->SetInputData(data);
  return writer->Write() != 0 && writer->GetErrorCode() == 0;
}

template <class Writer, class Data>
bool write_xml(Data* data, const std::filesystem::path& path) {
  const vtkNew<Writer> writer;
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToNone();
  writer->SetHeaderTypeToUInt64();
  return run_writer(writer.Get(), data, path);
}

/// The mesh as a surface. Throws unless it is one.
vtkSmartPointer<vtkPolyData> moved_surface(const std::filesystem::path& path, const MeshFile& file,
                                           bool only_triangles) {
  const auto refuse = [&](const CellKind& kind) {
    fail("ELEMENT_NOT_SUPPORTED", path,
         extension_of(path) + " files cannot carry a " + std::string(kind.name));
  };
  for (const ElementBlock& block : file.mesh.blocks) {
    const CellKind& kind = cell_kind(block.type);
    if (kind.dimension == 3 || is_second_order(kind) ||
        (only_triangles && block.type != ElementType::triangle)) {
      refuse(kind);
    }
  }
  const auto dataset = moved_dataset(file);
  if (auto* surface = vtkPolyData::SafeDownCast(dataset)) return surface;

  const auto grid = moved_grid(file);
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(grid->GetPoints());
  surface->AllocateEstimate(grid->GetNumberOfCells(), 4);
  const vtkNew<vtkIdList> cell;
  bool same_order = true;  // PolyData keeps points, edges and faces apart
  int last_dimension = 0;
  for (vtkIdType id = 0; id < grid->GetNumberOfCells(); ++id) {
    grid->GetCellPoints(id, cell);
    const CellKind* kind =
        find_vtk_cell(grid->GetCellType(id), static_cast<std::size_t>(cell->GetNumberOfIds()));
    if (kind != nullptr && is_second_order(*kind)) refuse(*kind);
    surface->InsertNextCell(grid->GetCellType(id), cell);
    const int dimension = kind == nullptr ? 0 : kind->dimension;
    same_order = same_order && dimension >= last_dimension;
    last_dimension = dimension;
  }
  if (!same_order && !file.element_quality.metrics.empty()) {
    fail("ARRAYS_NOT_SUPPORTED", path,
         extension_of(path) +
             " files keep cells in the order of their dimension, in which those of "
             "this file are not; write .vtu");
  }
  surface->GetPointData()->ShallowCopy(grid->GetPointData());
  if (same_order) surface->GetCellData()->ShallowCopy(grid->GetCellData());
  surface->GetFieldData()->ShallowCopy(grid->GetFieldData());
  return surface;
}

bool write_legacy(const std::filesystem::path& path, const MeshFile& file) {
  const auto dataset = moved_dataset(file);
  if (auto* surface = vtkPolyData::SafeDownCast(dataset)) {
    const vtkNew<vtkPolyDataWriter> writer;
    writer->SetFileTypeToBinary();
    return run_writer(writer.Get(), surface, path);
  }
  const vtkNew<vtkUnstructuredGridWriter> writer;
  writer->SetFileTypeToBinary();
  return run_writer(writer.Get(), vtkUnstructuredGrid::SafeDownCast(dataset), path);
}

bool write_stl(const std::filesystem::path& path, const MeshFile& file) {
  const vtkNew<vtkSTLWriter> writer;
  writer->SetFileTypeToBinary();
  return run_writer(writer.Get(), moved_surface(path, file, true).Get(), path);
}

bool write_by_extension(const std::filesystem::path& path, const MeshFile& file) {
  const std::string extension = extension_of(path);
  if (extension == ".vtu") {
    return write_xml<vtkXMLUnstructuredGridWriter>(moved_grid(file).Get(), path);
  }
  if (extension == ".vtp") {
    return write_xml<vtkXMLPolyDataWriter>(moved_surface(path, file, false).Get(), path);
  }
  if (extension == ".stl") return write_stl(path, file);
  return write_legacy(path, file);
}

}  // namespace

MeshFile read_vtk(const std::filesystem::path& path) {
  check_signature(path);
  vtkSmartPointer<vtkPointSet> dataset;
  {
    const CapturedErrors errors;
    const auto data = run_reader_of(path);
    if (const std::string what = errors.first(); !what.empty()) {
      fail("FORMAT_ERROR", path, "VTK cannot read it: " + what);
    }
    if (!data) fail("FORMAT_ERROR", path, "VTK finds no data set in it");
    dataset = vtkPointSet::SafeDownCast(data);
    const bool known = vtkUnstructuredGrid::SafeDownCast(data) != nullptr ||
                       vtkPolyData::SafeDownCast(data) != nullptr;
    if (!known) {
      fail("ELEMENT_NOT_SUPPORTED", path,
           "it holds a " + std::string(data->GetClassName()) +
               "; only unstructured grids and polygon data can be smoothed");
    }
  }
  if (dataset->GetPoints() != nullptr) check_arrays(path, *dataset);
  FileContent content;
  content.extension = extension_of(path);
  content.dataset = std::make_shared<VtkDataset>(dataset);
  for (const PhysicalName& group : physical_names(dataset->GetFieldData())) {
    content.groups.push_back({group.dimension, group.called(), kPhysicalArray, {group.tag}});
  }
  return make_mesh_file(path, std::move(content));
}

void write_vtk(const std::filesystem::path& path, const MeshFile& file) {
  const CapturedErrors errors;
  if (!write_by_extension(path, file)) {
    const std::string what = errors.first();
    fail("FILE_NOT_WRITABLE", path, what.empty() ? "VTK could not write it" : what);
  }
}

}  // namespace meshsmooth::formats

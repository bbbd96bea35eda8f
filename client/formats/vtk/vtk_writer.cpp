#include <vtkCellData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkUnstructuredGridWriter.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <string>

#include "cells.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "vtk/captured_errors.hpp"
#include "vtk/in_place.hpp"
#include "vtk/layout.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

template <class Writer, class Data>
bool run_writer(Writer* writer, Data* data, const std::filesystem::path& path) {
  writer->SetFileName(path.c_str());
  writer->SetInputData(data);
  return writer->Write() != 0 && writer->GetErrorCode() == 0;
}

/// The layout of a file that was read in the format in which it is written; or null.
const VtkLayout* own_layout(const std::filesystem::path& path, const MeshFile& file) {
  if (!file.content() || file.content()->extension != extension_of(path)) return nullptr;
  const auto* dataset = dynamic_cast<const VtkDataset*>(file.content()->dataset.get());
  return dataset == nullptr ? nullptr : dataset->layout();
}

/// As the file was that is written again.
void take_settings(vtkXMLWriter& writer, const VtkLayout& layout) {
  using Compressor = NumberBlock::Compressor;
  if (layout.appended) {
    writer.SetDataModeToAppended();
    writer.SetEncodeAppendedData(!layout.raw);
  } else if (!layout.pieces.empty() &&
             layout.pieces[0].points.encoding == NumberBlock::Encoding::ascii) {
    writer.SetDataModeToAscii();
  } else {
    writer.SetDataModeToBinary();
  }
  if (layout.compressor == Compressor::zlib) writer.SetCompressorTypeToZLib();
  if (layout.compressor == Compressor::lz4) writer.SetCompressorTypeToLZ4();
  if (layout.compressor == Compressor::lzma) writer.SetCompressorTypeToLZMA();
  writer.SetHeaderType(layout.header_bytes == 4 ? vtkXMLWriter::UInt32 : vtkXMLWriter::UInt64);
  writer.SetByteOrder(layout.big_endian ? vtkXMLWriter::BigEndian : vtkXMLWriter::LittleEndian);
}

template <class Writer, class Data>
bool write_xml(Data* data, const std::filesystem::path& path, const VtkLayout* layout) {
  const vtkNew<Writer> writer;
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToNone();
  writer->SetHeaderTypeToUInt64();
  if (layout != nullptr) take_settings(*writer, *layout);
  return run_writer(writer.Get(), data, path);
}

/// The mesh as a surface. Throws unless it is one.
vtkSmartPointer<vtkPolyData> moved_surface(const std::filesystem::path& path,
                                           const MeshFile& file) {
  const auto refuse = [&](const CellKind& kind) {
    fail("ELEMENT_NOT_SUPPORTED", path,
         extension_of(path) + " files cannot carry a " + std::string(kind.name));
  };
  for (const ElementBlock& block : file.mesh.blocks) {
    const CellKind& kind = cell_kind(block.type);
    if (kind.dimension == 3 || is_second_order(kind)) refuse(kind);
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

/// By way of the memory: these writers do not hear that the last bytes did not fit onto the disk.
template <class Writer, class Data>
bool write_legacy(Data* data, const std::filesystem::path& path, const VtkLayout* layout) {
  const vtkNew<Writer> writer;
  writer->WriteToOutputStringOn();
  writer->SetFileTypeToBinary();
  if (layout != nullptr) {
    writer->SetHeader(layout->title.c_str());
    if (!layout->binary) writer->SetFileTypeToASCII();
    const bool newer = layout->major_version >= 5;
    writer->SetFileVersion(newer ? vtkDataWriter::VTK_LEGACY_READER_VERSION_5_1
                                 : vtkDataWriter::VTK_LEGACY_READER_VERSION_4_2);
  }
  writer->SetInputData(data);
  if (writer->Write() == 0 || writer->GetErrorCode() != 0) return false;
  std::string bytes(writer->GetOutputString(),
                    static_cast<std::size_t>(writer->GetOutputStringLength()));
  // The same structure goes by several versions.
  if (layout != nullptr) bytes.replace(0, bytes.find('\n'), layout->version);
  write_bytes(path, bytes);
  return true;
}

bool write_by_extension(const std::filesystem::path& path, const MeshFile& file) {
  const std::string extension = extension_of(path);
  const VtkLayout* const layout = own_layout(path, file);
  if (extension == ".vtu") {
    const auto grid = moved_grid(file, Voxels::keep_unmoved);
    return write_xml<vtkXMLUnstructuredGridWriter>(grid.Get(), path, layout);
  }
  if (extension == ".vtp") {
    return write_xml<vtkXMLPolyDataWriter>(moved_surface(path, file).Get(), path, layout);
  }
  const auto dataset = moved_dataset(file);
  if (auto* surface = vtkPolyData::SafeDownCast(dataset)) {
    return write_legacy<vtkPolyDataWriter>(surface, path, layout);
  }
  return write_legacy<vtkUnstructuredGridWriter>(vtkUnstructuredGrid::SafeDownCast(dataset), path,
                                                 layout);
}

}  // namespace

void write_vtk(const std::filesystem::path& path, const MeshFile& file) {
  const CapturedErrors errors;
  const VtkLayout* const layout = own_layout(path, file);
  const bool arrays = !file.element_quality.metrics.empty() || !file.element_arrays.empty();
  if (layout != nullptr && layout->in_place && !arrays) {
    const auto& dataset = dynamic_cast<const VtkDataset&>(*file.content()->dataset);
    write_bytes(path, moved_file(file.content()->text, dataset, file.mesh));
    return;
  }
  if (!write_by_extension(path, file)) {
    const std::string what = errors.first();
    fail("FILE_NOT_WRITABLE", path, what.empty() ? "VTK could not write it" : what);
  }
}

}  // namespace meshsmooth::formats

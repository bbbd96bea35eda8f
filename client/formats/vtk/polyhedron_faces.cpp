#include "vtk/polyhedron_faces.hpp"

#include <vtkCellArray.h>
#include <vtkIdTypeArray.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "dataset.hpp"

namespace meshsmooth::formats {
namespace {

/// The faces of a piece: the nodes of all, where those of each end; of the polyhedra: the faces of
/// all, where those of each cell end.
struct Faces {
  std::vector<double> nodes, node_ends, faces, face_ends;
};

std::optional<Faces> read_faces(std::string_view file, const VtkPiece& piece) {
  std::vector<std::vector<double>> lists;
  for (const NumberBlock& block : piece.faces) {
    auto numbers = read_numbers(file, block);
    if (!numbers) return std::nullopt;
    lists.push_back(std::move(*numbers));
  }
  return Faces{std::move(lists[0]), std::move(lists[1]), std::move(lists[2]), std::move(lists[3])};
}

/// The part of a list between two ends; none: there is no such part.
std::optional<std::span<const double>> part_of(const std::vector<double>& list,
                                               const std::vector<double>& ends, double place) {
  if (!(place >= 0) || place >= static_cast<double>(ends.size())) return std::nullopt;
  const auto index = static_cast<std::size_t>(place);
  const double begin = index == 0 ? 0 : ends[index - 1];
  const double end = ends[index];
  if (!(begin >= 0) || !(end >= begin) || end > static_cast<double>(list.size())) {
    return std::nullopt;
  }
  return std::span(list).subspan(static_cast<std::size_t>(begin),
                                 static_cast<std::size_t>(end - begin));
}

/// Appends the number of faces, and of each its number of nodes and these.
bool append_faces(const Faces& faces, std::size_t cell, vtkIdType first_node,
                  vtkIdTypeArray& stream) {
  const auto own = part_of(faces.faces, faces.face_ends, static_cast<double>(cell));
  if (!own) return false;
  stream.InsertNextValue(static_cast<vtkIdType>(own->size()));
  for (const double face : *own) {
    const auto nodes = part_of(faces.nodes, faces.node_ends, face);
    if (!nodes) return false;
    stream.InsertNextValue(static_cast<vtkIdType>(nodes->size()));
    for (const double node : *nodes) {
      stream.InsertNextValue(static_cast<vtkIdType>(node) + first_node);
    }
  }
  return true;
}

}  // namespace

bool add_faces(std::string_view file, const VtkLayout& layout, vtkUnstructuredGrid& grid) {
  const bool newer = std::ranges::any_of(
      layout.pieces, [](const VtkPiece& piece) { return !piece.faces.empty(); });
  if (!newer || grid.GetFaces() != nullptr) return true;
  const vtkNew<vtkIdTypeArray> stream, places;
  vtkIdType cell = 0, first_node = 0;
  for (const VtkPiece& piece : layout.pieces) {
    std::optional<Faces> faces;
    if (!piece.faces.empty() && !(faces = read_faces(file, piece))) return false;
    for (std::size_t own = 0; own < piece.cell_count; ++own, ++cell) {
      if (cell >= grid.GetNumberOfCells()) return false;
      const bool is_polyhedron = grid.GetCellType(cell) == kPolyhedronCell;
      places->InsertNextValue(is_polyhedron ? stream->GetNumberOfValues() : -1);
      if (!is_polyhedron) continue;
      if (!faces || !append_faces(*faces, own, first_node, *stream)) return false;
    }
    first_node += static_cast<vtkIdType>(piece.node_count);
  }
  const vtkNew<vtkUnsignedCharArray> types;
  types->DeepCopy(grid.GetCellTypesArray());
  const vtkSmartPointer<vtkCellArray> cells = grid.GetCells();
  grid.SetCells(types, cells, places, stream);
  return true;
}

}  // namespace meshsmooth::formats

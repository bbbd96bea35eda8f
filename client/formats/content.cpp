#include "content.hpp"

#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkPointData.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "cells.hpp"

namespace meshsmooth::formats {
namespace {

/// Dimension of a cell that may be a passenger or part of the mesh.
int cell_dimension(const std::filesystem::path& path, int type, std::int64_t node_count,
                   std::int64_t id) {
  if (const CellKind* kind = find_vtk_cell(type, node_count)) return kind->dimension;
  if (type == VTK_POLY_VERTEX) return 0;
  if (type == VTK_POLY_LINE) return 1;
  std::string name = vtk_cell_name(type);
  if (type == VTK_POLYGON) name = "polygon of " + std::to_string(node_count) + " nodes";
  fail("ELEMENT_NOT_SUPPORTED", path,
       "element " + std::to_string(id) + " is of the type " + name +
           "; only linear triangles, quads, tetrahedra, pyramids, wedges and hexahedra can be "
           "smoothed");
}

/// The cells that are not of the mesh's dimension.
class Passengers {
 public:
  explicit Passengers(std::size_t node_count) : used_(node_count, 0) {}
  void add(vtkIdList* cell) {
    ++count_;
    for (vtkIdType corner = 0; corner < cell->GetNumberOfIds(); ++corner) {
      const auto node = static_cast<std::size_t>(cell->GetId(corner));
      if (node < used_.size()) used_[node] = 1;
    }
  }
  void store(FileContent& content) const {
    content.passenger_count = count_;
    for (std::size_t node = 0; node < used_.size(); ++node) {
      if (used_[node] != 0) content.passenger_nodes.push_back(static_cast<NodeId>(node));
    }
  }

 private:
  std::vector<std::uint8_t> used_;
  std::int64_t count_ = 0;
};

/// One block per type, in the order in which the types come up.
class Blocks {
 public:
  void add(ElementType type, vtkIdList* cell, std::int64_t id) {
    std::size_t& place = places_[static_cast<std::size_t>(type)];
    if (place == kNowhere) {
      place = blocks_.size();
      blocks_.push_back({type, {}});
      ids_.emplace_back();
    }
    for (vtkIdType corner = 0; corner < cell->GetNumberOfIds(); ++corner) {
      blocks_[place].nodes.push_back(static_cast<NodeId>(cell->GetId(corner)));
    }
    ids_[place].push_back(id);
  }
  void store(Mesh& mesh, FileContent& content) {
    mesh.blocks = std::move(blocks_);
    for (const auto& ids : ids_) {
      content.element_ids.insert(content.element_ids.end(), ids.begin(), ids.end());
    }
  }

 private:
  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  std::array<std::size_t, kElementTypeCount> places_ = {kNowhere, kNowhere, kNowhere,
                                                        kNowhere, kNowhere, kNowhere};
  std::vector<ElementBlock> blocks_;
  std::vector<std::vector<std::int64_t>> ids_;
};

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

vtkSmartPointer<vtkUnstructuredGrid> grid_of_mesh(const Mesh& mesh) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->Allocate(static_cast<vtkIdType>(mesh.element_count()));
  for (const ElementBlock& block : mesh.blocks) {
    const CellKind& kind = cell_kind(block.type);
    const auto corners = static_cast<std::size_t>(kind.node_count);
    std::array<vtkIdType, 8> cell{};
    for (std::size_t first = 0; first < block.nodes.size(); first += corners) {
      std::copy_n(block.nodes.begin() + static_cast<std::ptrdiff_t>(first), corners, cell.begin());
      grid->InsertNextCell(kind.vtk_type, kind.node_count, cell.data());
    }
  }
  return grid;
}

}  // namespace

void check_node_count(const MeshFile& file) {
  const auto& content = file.content();
  if (!content) return;
  const auto expected = static_cast<std::size_t>(content->dataset->GetNumberOfPoints());
  if (file.mesh.node_count() != expected) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                      "the mesh has " + std::to_string(file.mesh.node_count()) +
                          " nodes, the file it was read from " + std::to_string(expected));
  }
}

MeshFile make_mesh_file(const std::filesystem::path& path, FileContent content,
                        const std::vector<std::int64_t>& cell_ids) {
  vtkPointSet& dataset = *content.dataset;
  const vtkIdType node_count = dataset.GetNumberOfPoints();
  const vtkIdType cell_count = dataset.GetNumberOfCells();
  if (node_count == 0) fail("MESH_EMPTY", path, "there are no nodes in it");
  if (node_count > std::numeric_limits<NodeId>::max()) {
    fail("FORMAT_ERROR", path, std::to_string(node_count) + " nodes are more than 2147483647");
  }

  const auto id_of = [&](vtkIdType cell) {
    return cell_ids.empty() ? cell : cell_ids[static_cast<std::size_t>(cell)];
  };
  const vtkNew<vtkIdList> cell;
  std::vector<std::int8_t> dimensions(static_cast<std::size_t>(cell_count));
  for (vtkIdType id = 0; id < cell_count; ++id) {
    dataset.GetCellPoints(id, cell);
    dimensions[static_cast<std::size_t>(id)] = static_cast<std::int8_t>(
        cell_dimension(path, dataset.GetCellType(id), cell->GetNumberOfIds(), id_of(id)));
  }
  const auto highest = std::max_element(dimensions.begin(), dimensions.end());
  if (highest == dimensions.end() || *highest < 2) {
    fail("MESH_EMPTY", path, "there are no surface or volume elements in it");
  }

  Mesh mesh;
  Blocks blocks;
  Passengers passengers(static_cast<std::size_t>(node_count));
  for (vtkIdType id = 0; id < cell_count; ++id) {
    dataset.GetCellPoints(id, cell);
    if (dimensions[static_cast<std::size_t>(id)] < *highest) {
      passengers.add(cell);
    } else {
      const CellKind* kind = find_vtk_cell(dataset.GetCellType(id), cell->GetNumberOfIds());
      blocks.add(*kind->element, cell, id_of(id));
    }
  }
  if (dataset.GetPoints()->GetDataType() == VTK_FLOAT) {
    mesh.positions = copy_positions<float>(dataset.GetPoints());
  } else {
    mesh.positions = copy_positions<double>(dataset.GetPoints());
  }
  blocks.store(mesh, content);
  passengers.store(content);
  if (!content.node_ids.empty()) {
    auto& order = content.nodes_by_id;
    order.resize(content.node_ids.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](NodeId a, NodeId b) {
      return content.node_ids[static_cast<std::size_t>(a)] <
             content.node_ids[static_cast<std::size_t>(b)];
    });
  }
  return {std::move(mesh), std::make_shared<const FileContent>(std::move(content))};
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

vtkSmartPointer<vtkPointSet> moved_dataset(const MeshFile& file) {
  if (!file.content()) return moved_grid(file);
  vtkPointSet* source = file.content()->dataset;
  auto dataset = vtkSmartPointer<vtkPointSet>::Take(source->NewInstance());
  dataset->ShallowCopy(source);
  dataset->SetPoints(make_points(file.mesh.positions_view()));
  return dataset;
}

vtkSmartPointer<vtkUnstructuredGrid> moved_grid(const MeshFile& file) {
  vtkSmartPointer<vtkUnstructuredGrid> grid;
  if (!file.content()) {
    grid = grid_of_mesh(file.mesh);
  } else {
    const auto dataset = moved_dataset(file);
    grid = vtkUnstructuredGrid::SafeDownCast(dataset);
    if (!grid) grid = grid_of_cells(dataset);
  }
  grid->SetPoints(make_points(file.mesh.positions_view()));
  return grid;
}

}  // namespace meshsmooth::formats

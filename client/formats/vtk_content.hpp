#pragma once

#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointSet.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

#include "content.hpp"

namespace meshsmooth::formats {

struct VtkLayout;

/// A file as VTK's classes hold it, with all its data. One thread at a time.
class VtkDataset final : public Dataset {
 public:
  /// `layout`: of the file that the data were read from.
  explicit VtkDataset(vtkSmartPointer<vtkPointSet> data,
                      std::shared_ptr<const VtkLayout> layout = nullptr);

  [[nodiscard]] vtkPointSet* data() const { return data_; }
  [[nodiscard]] const VtkLayout* layout() const { return layout_.get(); }
  [[nodiscard]] bool has_voxels() const { return has_voxels_; }

  [[nodiscard]] std::int64_t node_count() const override;
  [[nodiscard]] std::int64_t cell_count() const override;
  /// Pixels and voxels as quads and hexahedra.
  void get_cell(std::int64_t id, Cell& cell) const override;
  [[nodiscard]] Positions positions() const override;
  [[nodiscard]] std::vector<Column> node_columns() const override;
  [[nodiscard]] std::vector<Column> cell_columns() const override;
  [[nodiscard]] std::optional<Column> node_column(const std::string& name) const override;
  [[nodiscard]] std::optional<std::vector<Vec3d>> node_vectors(
      const std::string& name) const override;
  [[nodiscard]] std::optional<Column> cell_column(const std::string& name) const override;
  /// Also arrays of several numbers or texts, field data and the faces of polyhedra.
  [[nodiscard]] std::vector<StoredArray> stored_arrays() const override;
  [[nodiscard]] std::string cell_name(int type) const override { return vtk_cell_name(type); }

  /// "quadratic tetrahedron (VTK cell type 24)".
  [[nodiscard]] static std::string vtk_cell_name(int type);

 private:
  vtkSmartPointer<vtkPointSet> data_;
  std::shared_ptr<const VtkLayout> layout_;
  bool has_voxels_ = false;
  vtkNew<vtkIdList> nodes_;  // of the cell just asked for: making a list costs more
};

[[nodiscard]] std::vector<PhysicalName> physical_names(vtkFieldData* data);
void add_physical_names(vtkFieldData* data, const std::vector<PhysicalName>& names);

/// The positions as points of the same precision.
[[nodiscard]] vtkSmartPointer<vtkPoints> make_points(const PositionsView& positions);

/// What becomes of pixels and voxels: those of which a node has moved are quads and hexahedra.
enum class Voxels { keep_unmoved, turn_all };

/// The file's data set with the mesh's positions.
[[nodiscard]] vtkSmartPointer<vtkPointSet> moved_dataset(const MeshFile& file,
                                                         Voxels voxels = Voxels::keep_unmoved);
/// The same as an unstructured grid.
[[nodiscard]] vtkSmartPointer<vtkUnstructuredGrid> moved_grid(const MeshFile& file,
                                                              Voxels voxels = Voxels::turn_all);

}  // namespace meshsmooth::formats

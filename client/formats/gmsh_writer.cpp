#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>

#include "cells.hpp"
#include "gmsh_fields.hpp"
#include "gmsh_session.hpp"
#include "node_orders.hpp"
#include "readers.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;
using Tags = std::vector<std::size_t>;

/// The ids of an array if Gmsh can take them (positive, each once), else 1, 2 …
Tags make_tags(vtkDataArray* ids, vtkIdType count) {
  Tags tags(static_cast<std::size_t>(count));
  for (std::size_t place = 0; place < tags.size(); ++place) tags[place] = place + 1;
  if (ids == nullptr) return tags;
  Tags own(tags.size());
  for (std::size_t place = 0; place < own.size(); ++place) {
    const double id = ids->GetComponent(static_cast<vtkIdType>(place), 0);
    if (!(id >= 1) || id > 1e15) return tags;
    own[place] = static_cast<std::size_t>(id);
  }
  Tags sorted = own;
  std::sort(sorted.begin(), sorted.end());
  const bool unique = std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  return unique ? own : tags;
}

/// Elements of one entity and type.
struct Batch {
  Tags tags;
  Tags nodes;
};

/// Puts the grid into Gmsh's model.
class ModelBuilder {
 public:
  ModelBuilder(const path& file, vtkUnstructuredGrid& grid)
      : file_(file),
        grid_(grid),
        node_tags_(
            make_tags(grid.GetPointData()->GetArray(kNodeIdArray), grid.GetNumberOfPoints())),
        cell_tags_(
            make_tags(grid.GetCellData()->GetArray(kElementIdArray), grid.GetNumberOfCells())) {}

  void build() {
    sort_cells();
    for (const auto& [key, entity] : entities_) {
      gmsh::model::addDiscreteEntity(std::get<0>(key), entity);
    }
    add_nodes();
    for (const auto& [key, batch] : batches_) {
      gmsh::model::mesh::addElementsByType(std::get<1>(key), std::get<2>(key), batch.tags,
                                           batch.nodes);
    }
    add_physical_groups();
  }

  [[nodiscard]] const Tags& node_tags() const { return node_tags_; }
  [[nodiscard]] const Tags& cell_tags() const { return cell_tags_; }
  [[nodiscard]] bool has_physical_groups() const { return !groups_.empty(); }

 private:
  // Dimension, the caller's entity, physical group, and whether nodes lie on edges or on faces.
  using EntityKey = std::tuple<int, int, int, int>;

  /// Gmsh writes one of the types of a shape in an entity only, and drops the others.
  static int variant(const CellKind& kind) {
    if (!is_second_order(kind)) return 0;
    const bool full = kind.element == ElementType::quad9 || kind.element == ElementType::wedge18 ||
                      kind.element == ElementType::hexahedron27;
    return full ? 2 : 1;
  }

  static int value(vtkDataArray* array, vtkIdType cell, int otherwise) {
    return array == nullptr ? otherwise : static_cast<int>(array->GetComponent(cell, 0));
  }

  /// An entity belongs to at most one physical group here; where the caller's
  /// belongs to several by its elements or has several types of a shape, it is split.
  int entity_of(const EntityKey& key) {
    const auto known = entities_.find(key);
    if (known != entities_.end()) return known->second;
    auto& taken = taken_[std::get<0>(key)];
    int tag = std::max(std::get<1>(key), 1);
    while (!taken.insert(tag).second) ++tag;
    return entities_[key] = tag;
  }

  void sort_cells() {
    vtkCellData* data = grid_.GetCellData();
    vtkDataArray* physicals = data->GetArray(kPhysicalArray);
    vtkDataArray* own = data->GetArray(kEntityArray);
    if (own == nullptr) own = data->GetArray(kReferenceArray);
    const vtkNew<vtkIdList> cell;
    for (vtkIdType id = 0; id < grid_.GetNumberOfCells(); ++id) {
      grid_.GetCellPoints(id, cell);
      const CellKind* kind =
          find_vtk_cell(grid_.GetCellType(id), static_cast<std::size_t>(cell->GetNumberOfIds()));
      if (kind == nullptr) {
        fail("ELEMENT_NOT_SUPPORTED", file_,
             extension_of(file_) + " files cannot carry a " +
                 VtkDataset::vtk_cell_name(grid_.GetCellType(id)));
      }
      const int physical = value(physicals, id, 0);
      const int entity = entity_of(
          {kind->dimension, value(own, id, std::max(physical, 1)), physical, variant(*kind)});
      if (physical > 0) groups_[{kind->dimension, physical}].insert(entity);
      Batch& batch = batches_[{kind->dimension, entity, kind->gmsh_type}];
      batch.tags.push_back(cell_tags_[static_cast<std::size_t>(id)]);
      const std::size_t first = batch.nodes.size();
      batch.nodes.resize(first + static_cast<std::size_t>(kind->node_count));
      vtkIdType node = 0;
      for (const std::int8_t place : places_in(NodeOrder::gmsh, *kind)) {
        batch.nodes[first + static_cast<std::size_t>(place)] =
            node_tags_[static_cast<std::size_t>(cell->GetId(node++))];
      }
    }
  }

  void add_nodes() const {
    Tags tags;
    std::vector<double> positions;
    for (std::size_t node = 0; node < node_tags_.size(); ++node) {
      std::array<double, 3> position{};
      grid_.GetPoint(static_cast<vtkIdType>(node), position.data());
      tags.push_back(node_tags_[node]);
      positions.insert(positions.end(), position.begin(), position.end());
    }
    const auto& [key, entity] = *entities_.rbegin();  // of the highest dimension
    gmsh::model::mesh::addNodes(std::get<0>(key), entity, tags, positions);
  }

  void add_physical_groups() const {
    for (const auto& [group, members] : groups_) {
      gmsh::model::addPhysicalGroup(group.first, {members.begin(), members.end()}, group.second);
    }
    for (const PhysicalName& group : physical_names(grid_.GetFieldData())) {
      if (group.name.empty()) continue;
      gmsh::model::setPhysicalName(group.dimension, group.tag, group.name);
    }
  }

  const path& file_;
  vtkUnstructuredGrid& grid_;
  Tags node_tags_;
  Tags cell_tags_;
  std::map<EntityKey, int> entities_;
  std::map<int, std::set<int>> taken_;
  std::map<std::tuple<int, int, int>, Batch> batches_;  // dimension, entity, Gmsh type
  std::map<std::pair<int, int>, std::set<int>> groups_;
};

bool is_reserved(const std::string& name) {
  return name == kPhysicalArray || name == kEntityArray || name == kReferenceArray ||
         name == kNodeIdArray || name == kElementIdArray;
}

/// Data arrays become data sections; Gmsh knows 1, 3 and 9 components.
void append_views(const path& file, vtkFieldData* data, const char* kind, const Tags& tags) {
  for (int index = 0; index < data->GetNumberOfArrays(); ++index) {
    vtkDataArray* array = data->GetArray(index);
    const std::string name = data->GetArrayName(index) == nullptr ? "" : data->GetArrayName(index);
    if (array == nullptr || is_reserved(name)) continue;
    const int own = array->GetNumberOfComponents();
    const int components = own == 1 ? 1 : own <= 3 ? 3 : 9;
    std::vector<std::vector<double>> values(tags.size());
    for (std::size_t row = 0; row < tags.size(); ++row) {
      values[row].assign(static_cast<std::size_t>(components), 0.0);
      for (int part = 0; part < std::min(own, components); ++part) {
        values[row][static_cast<std::size_t>(part)] =
            array->GetComponent(static_cast<vtkIdType>(row), part);
      }
    }
    const int view = gmsh::view::add(name);
    gmsh::view::addModelData(view, 0, "mesh", kind, tags, values, 0, components);
    gmsh::view::write(view, file.string(), true);
  }
}

/// Gmsh does not report a full disk: what it has written must be readable to its end.
CoordinateFields find_written_coordinates(const path& file, const std::string& text) {
  constexpr const char* kUnfinished = "Gmsh could not write it to its end";
  try {
    CoordinateFields fields = find_coordinates(file, text);
    const bool msh = extension_of(file) == ".msh";
    if (msh && text.find("\n$EndElements") == std::string::npos) {
      fail("FILE_NOT_WRITABLE", file, kUnfinished);
    }
    return fields;
  } catch (const Error&) {
    fail("FILE_NOT_WRITABLE", file, kUnfinished);
  }
}

/// Gmsh heads a deck with the name of its file, here one that is about to be another.
std::string with_own_heading(std::string text) {
  constexpr std::string_view kHeading = "*Heading\n";
  if (!text.starts_with(kHeading)) return text;
  return text.replace(kHeading.size(), text.find('\n', kHeading.size()) - kHeading.size(),
                      " written by meshsmooth");
}

/// Gmsh prints too few digits; here every coordinate gets all it needs.
void complete_text(const path& file, vtkUnstructuredGrid& grid, const Tags& node_tags) {
  const std::string text = read_bytes(file);
  CoordinateFields fields = find_written_coordinates(file, text);
  constexpr double kOther = std::numeric_limits<double>::quiet_NaN();
  for (Vec3d& read : fields.positions) read = {kOther, kOther, kOther};  // write all anew
  std::unordered_map<std::int64_t, vtkIdType> index_of;
  for (std::size_t node = 0; node < node_tags.size(); ++node) {
    index_of.emplace(static_cast<std::int64_t>(node_tags[node]), static_cast<vtkIdType>(node));
  }
  std::vector<Vec3d> positions;
  positions.reserve(fields.node_ids.size());
  for (const std::int64_t id : fields.node_ids) {
    std::array<double, 3> position{};
    grid.GetPoint(index_of.at(id), position.data());
    positions.push_back({position[0], position[1], position[2]});
  }
  write_bytes(
      file, with_own_heading(replace_coordinates(text, fields, std::span<const Vec3d>(positions))));
}

/// What Gmsh's writers leave out without a word, write without the nodes in the middle or under
/// names that nobody reads.
bool can_carry(const std::string& extension, ElementType type) {
  if (extension == ".msh") return true;
  switch (type) {
    case ElementType::pyramid:
      return extension != ".inp";
    case ElementType::quad9:
      return extension == ".inp";
    case ElementType::pyramid13:
    case ElementType::wedge18:
    case ElementType::hexahedron27:
      return false;
    default:
      return true;
  }
}

void check_cells(const path& file, const Mesh& mesh) {
  for (const ElementBlock& block : mesh.blocks) {
    if (!can_carry(extension_of(file), block.type)) {
      fail("ELEMENT_NOT_SUPPORTED", file,
           extension_of(file) + " files cannot carry a " + std::string(element_name(block.type)));
    }
  }
}

}  // namespace

void write_gmsh(const path& file, const MeshFile& mesh_file) {
  const std::string extension = extension_of(file);
  const auto& content = mesh_file.content();
  if (content && content->extension == extension && !content->text.empty()) {
    write_bytes(
        file, replace_coordinates(content->text, content->fields, mesh_file.mesh.positions_view()));
    return;
  }
  check_cells(file, mesh_file.mesh);
  const auto grid = moved_grid(mesh_file);
  {
    GmshSession session;
    session.run("FILE_NOT_WRITABLE", file, [&] {
      ModelBuilder model(file, *grid);
      model.build();
      gmsh::option::setNumber("Mesh.SaveAll", 1);
      gmsh::option::setNumber("Mesh.MshFileVersion", 4.1);
      gmsh::option::setNumber("Mesh.SaveElementTagType", model.has_physical_groups() ? 2 : 1);
      gmsh::option::setNumber("PostProcessing.SaveMesh", 0);
      gmsh::write(file.string());
      if (extension == ".msh") {
        append_views(file, grid->GetPointData(), "NodeData", model.node_tags());
        append_views(file, grid->GetCellData(), "ElementData", model.cell_tags());
      }
      complete_text(file, *grid, model.node_tags());
    });
  }
}

}  // namespace meshsmooth::formats

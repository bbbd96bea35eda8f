#include <vtkCellData.h>
#include <vtkIntArray.h>
#include <vtkLongLongArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <array>
#include <map>
#include <unordered_map>

#include "cells.hpp"
#include "gmsh_fields.hpp"
#include "gmsh_session.hpp"
#include "nastran_lines.hpp"
#include "node_orders.hpp"
#include "readers.hpp"
#include "temporary_folder.hpp"
#include "vtk_content.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;
using IndexOfId = std::unordered_map<std::int64_t, vtkIdType>;

/// One element as Gmsh tells of it; its node tags start at `first`.
struct Row {
  std::int64_t tag;
  const CellKind* kind;
  int entity;
  int physical;
  std::int32_t group_set;  // see `FileContent::group_sets`
  std::size_t first;
};

struct Elements {
  std::vector<Row> rows;
  std::vector<std::size_t> node_tags;
};

IndexOfId index_of(const std::vector<std::int64_t>& ids) {
  IndexOfId indices;
  indices.reserve(ids.size());
  for (const std::int64_t id : ids) indices.emplace(id, static_cast<vtkIdType>(indices.size()));
  return indices;
}

const CellKind& kind_of(const path& file, int gmsh_type, std::size_t first_tag) {
  if (const CellKind* kind = find_gmsh_cell(gmsh_type)) return *kind;
  std::string name;
  int dimension = 0;
  int order = 0;
  int node_count = 0;
  int corner_count = 0;
  std::vector<double> positions;
  gmsh::model::mesh::getElementProperties(gmsh_type, name, dimension, order, node_count, positions,
                                          corner_count);
  fail("ELEMENT_NOT_SUPPORTED", file,
       "element " + std::to_string(first_tag) + " is a \"" + name + "\" of order " +
           std::to_string(order) + "; " + kSupportedElements);
}

/// All elements, by ascending tag, which is the file's own order.
Elements get_elements(const path& file) {
  Elements found;
  std::map<std::vector<int>, std::int32_t> sets = {{{}, 0}};
  gmsh::vectorpair entities;
  gmsh::model::getEntities(entities);
  for (const auto& [dimension, entity] : entities) {
    std::vector<int> physicals;
    gmsh::model::getPhysicalGroupsForEntity(dimension, entity, physicals);
    std::vector<int> ordered = physicals;
    std::ranges::sort(ordered);
    const auto set = sets.emplace(ordered, static_cast<std::int32_t>(sets.size())).first;
    std::vector<int> types;
    std::vector<std::vector<std::size_t>> tags;
    std::vector<std::vector<std::size_t>> nodes;
    gmsh::model::mesh::getElements(types, tags, nodes, dimension, entity);
    for (std::size_t type = 0; type < types.size(); ++type) {
      if (tags[type].empty()) continue;
      const CellKind& kind = kind_of(file, types[type], tags[type].front());
      std::size_t first = found.node_tags.size();
      for (const std::size_t tag : tags[type]) {
        found.rows.push_back({static_cast<std::int64_t>(tag), &kind, entity,
                              physicals.empty() ? 0 : physicals.front(), set->second, first});
        first += static_cast<std::size_t>(kind.node_count);
      }
      found.node_tags.insert(found.node_tags.end(), nodes[type].begin(), nodes[type].end());
    }
  }
  std::stable_sort(found.rows.begin(), found.rows.end(),
                   [](const Row& a, const Row& b) { return a.tag < b.tag; });
  return found;
}

void add_cells(const path& file, const Elements& elements, const IndexOfId& nodes,
               vtkUnstructuredGrid& grid) {
  for (const Row& row : elements.rows) {
    std::array<vtkIdType, kMaxCellNodes> cell{};
    std::size_t count = 0;
    for (const std::int8_t place_in_cell : places_in(NodeOrder::gmsh, *row.kind)) {
      const auto place = row.first + static_cast<std::size_t>(place_in_cell);
      const auto node = nodes.find(static_cast<std::int64_t>(elements.node_tags[place]));
      if (node == nodes.end()) {
        fail("FORMAT_ERROR", file,
             "element " + std::to_string(row.tag) + " uses node " +
                 std::to_string(elements.node_tags[place]) + ", which is not in the file");
      }
      cell[count++] = node->second;
    }
    grid.InsertNextCell(row.kind->vtk_type, row.kind->node_count, cell.data());
  }
}

template <class Array, class Values, class Get>
void add_array(vtkFieldData* data, const char* name, const Values& values, Get get) {
  const vtkNew<Array> array;
  array->SetName(name);
  for (const auto& value : values) array->InsertNextValue(get(value));
  data->AddArray(array);
}

void add_groups(const Elements& elements, vtkUnstructuredGrid& grid, FileContent& content) {
  vtkFieldData* data = grid.GetCellData();
  add_array<vtkIntArray>(data, kEntityArray, elements.rows, [](auto& row) { return row.entity; });
  add_array<vtkLongLongArray>(data, kElementIdArray, elements.rows,
                              [](auto& row) { return row.tag; });
  add_array<vtkLongLongArray>(grid.GetPointData(), kNodeIdArray, content.node_ids,
                              [](auto id) { return id; });
  gmsh::vectorpair groups;
  gmsh::model::getPhysicalGroups(groups);
  if (groups.empty()) return;
  add_array<vtkIntArray>(data, kPhysicalArray, elements.rows,
                         [](auto& row) { return row.physical; });
  std::vector<PhysicalName> names;
  for (const auto& [dimension, tag] : groups) {
    PhysicalName& group = names.emplace_back(PhysicalName{dimension, tag, {}});
    gmsh::model::getPhysicalName(dimension, tag, group.name);
    std::vector<int> entities;
    gmsh::model::getEntitiesForPhysicalGroup(dimension, tag, entities);
    content.groups.push_back({dimension, group.called(), kEntityArray, std::move(entities)});
  }
  add_physical_names(grid.GetFieldData(), names);
  for (const Row& row : elements.rows) content.group_sets.push_back(row.group_set);
}

/// Gmsh runs as a script whatever it does not know, so it must know the file.
void check_signature(const path& file, const std::string& extension, std::string_view text) {
  if (file.extension() != extension) {
    fail("FORMAT_UNKNOWN", file, "Gmsh wants the extension in lower case, " + extension);
  }
  if ((extension == ".bdf" || extension == ".nas") &&
      text.find("ENDDATA") == std::string_view::npos) {
    const bool nastran = text.find("GRID") != std::string_view::npos;
    fail(nastran ? "FILE_TRUNCATED" : "FORMAT_ERROR", file, "there is no ENDDATA");
  }
}

/// NASTRAN's with marks that Gmsh needs.
void merge(const path& file, const FileContent& content) {
  const bool nastran = content.extension == ".bdf" || content.extension == ".nas";
  const std::string marked = nastran ? mark_continuations(content.text) : content.text;
  if (marked == content.text) {
    gmsh::merge(file.string());
    return;
  }
  const TemporaryFolder folder;
  const path copy = folder.path() / ("copy" + content.extension);
  write_bytes(copy, marked);
  gmsh::merge(copy.string());
}

}  // namespace

MeshFile read_gmsh(const path& file) {
  FileContent content;
  content.extension = extension_of(file);
  content.text = read_bytes(file);
  check_signature(file, content.extension, content.text);
  content.fields = find_coordinates(file, content.text);

  GmshSession session;
  session.run("FORMAT_ERROR", file, [&] { merge(file, content); });
  const Elements elements = get_elements(file);
  const IndexOfId nodes = index_of(content.fields.node_ids);
  if (nodes.size() != content.fields.node_ids.size()) {
    fail("FORMAT_ERROR", file, "two nodes have the same number");
  }
  const auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->SetPoints(make_points(std::span<const Vec3d>(content.fields.positions)));
  add_cells(file, elements, nodes, *grid);
  content.node_ids = content.fields.node_ids;
  add_groups(elements, *grid, content);

  content.cell_ids.reserve(elements.rows.size());
  for (const Row& row : elements.rows) content.cell_ids.push_back(row.tag);
  content.dataset = std::make_shared<VtkDataset>(grid);
  return make_mesh_file(file, std::move(content));
}

}  // namespace meshsmooth::formats

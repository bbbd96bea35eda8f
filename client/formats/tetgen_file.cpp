#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkPointData.h>

#include <array>
#include <charconv>
#include <unordered_map>

#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

path with_extension(path file, const char* extension) { return file.replace_extension(extension); }

vtkSmartPointer<vtkDoubleArray> make_attribute(std::size_t index) {
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(("tetgen:attribute_" + std::to_string(index)).c_str());
  return array;
}

/// Columns of attributes, and a column of markers, of nodes or tetrahedra.
struct Columns {
  std::vector<vtkSmartPointer<vtkDoubleArray>> attributes;
  vtkSmartPointer<vtkIntArray> markers;

  Columns(std::size_t attribute_count, bool has_markers) {
    for (std::size_t index = 0; index < attribute_count; ++index) {
      attributes.push_back(make_attribute(index));
    }
    if (has_markers) {
      markers = vtkSmartPointer<vtkIntArray>::New();
      markers->SetName(kMarkerArray);
    }
  }
  void read_row(Scanner& scanner) {
    for (const auto& array : attributes) array->InsertNextValue(scanner.number<double>());
    if (markers) markers->InsertNextValue(scanner.number<int>());
  }
  void store(vtkFieldData* data) const {
    for (const auto& array : attributes) data->AddArray(array);
    if (markers) data->AddArray(markers);
  }
};

void read_nodes(const path& file, FileContent& content) {
  content.text = read_bytes(file);
  Scanner scanner(file, content.text, '#');
  const std::size_t count = scanner.count();
  const std::string_view dimension = scanner.token();
  if (dimension != "3") scanner.refuse("dimension 3", dimension);
  const std::size_t attribute_count = scanner.count();
  Columns columns(attribute_count, scanner.count() != 0);
  for (std::size_t row = 0; row < count; ++row) {
    const auto id = scanner.number<std::int64_t>();
    const std::string_view x = scanner.token();
    const std::string_view y = scanner.token();
    const std::string_view z = scanner.token();
    content.fields.add(id, {x, y, z}, scanner);
    columns.read_row(scanner);
  }
  content.node_ids = content.fields.node_ids;
  content.dataset->SetPoints(make_points(std::span<const Vec3d>(content.fields.positions)));
  columns.store(content.dataset->GetPointData());
}

std::vector<std::int64_t> read_tetrahedra(const path& file, FileContent& content) {
  content.companion_text = read_bytes(file);
  Scanner scanner(file, content.companion_text, '#');
  const std::size_t count = scanner.count();
  const std::size_t corners = scanner.count();
  if (corners != 4) {
    fail("ELEMENT_NOT_SUPPORTED", file,
         "its elements have " + std::to_string(corners) +
             " nodes; only linear tetrahedra (4 nodes) can be smoothed");
  }
  Columns columns(scanner.count(), false);
  std::unordered_map<std::int64_t, vtkIdType> nodes;
  nodes.reserve(content.node_ids.size());
  for (const std::int64_t id : content.node_ids) {
    nodes.emplace(id, static_cast<vtkIdType>(nodes.size()));
  }

  auto* grid = vtkUnstructuredGrid::SafeDownCast(content.dataset);
  std::vector<std::int64_t> ids;
  for (std::size_t row = 0; row < count; ++row) {
    ids.push_back(scanner.number<std::int64_t>());
    std::array<vtkIdType, 4> cell{};
    for (vtkIdType& corner : cell) {
      const std::string_view word = scanner.token();
      const auto found = nodes.find(scanner.parse<std::int64_t>(word));
      if (found == nodes.end()) scanner.refuse("the number of a node in the .node file", word);
      corner = found->second;
    }
    grid->InsertNextCell(VTK_TETRA, 4, cell.data());
    columns.read_row(scanner);
  }
  columns.store(grid->GetCellData());
  return ids;
}

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text += ' ';
  text.append(digits.data(), end);
}

/// Arrays of one number each become attributes, the marker array the marker.
struct OutputColumns {
  std::vector<vtkDataArray*> attributes;
  vtkDataArray* markers;

  explicit OutputColumns(vtkFieldData* data) : markers(data->GetArray(kMarkerArray)) {
    for (int index = 0; index < data->GetNumberOfArrays(); ++index) {
      vtkDataArray* array = data->GetArray(index);
      if (array == nullptr || array == markers || array->GetNumberOfComponents() != 1) continue;
      const std::string name = array->GetName() == nullptr ? "" : array->GetName();
      if (name != kNodeIdArray && name != kElementIdArray) attributes.push_back(array);
    }
  }
  void append_row(std::string& text, vtkIdType row) const {
    for (vtkDataArray* array : attributes) append(text, array->GetTuple1(row));
    if (markers != nullptr) append(text, markers->GetTuple1(row));
  }
};

std::string make_node_text(vtkUnstructuredGrid& grid) {
  const OutputColumns columns(grid.GetPointData());
  std::string text = std::to_string(grid.GetNumberOfPoints()) + " 3 " +
                     std::to_string(columns.attributes.size()) +
                     (columns.markers == nullptr ? " 0\n" : " 1\n");
  for (vtkIdType node = 0; node < grid.GetNumberOfPoints(); ++node) {
    std::array<double, 3> place{};
    grid.GetPoint(node, place.data());
    text += std::to_string(node);
    for (const double value : place) append(text, value);
    columns.append_row(text, node);
    text += '\n';
  }
  return text;
}

std::string make_element_text(vtkUnstructuredGrid& grid) {
  OutputColumns columns(grid.GetCellData());
  columns.markers = nullptr;  // .ele files have none
  std::string rows;
  std::size_t count = 0;
  const vtkNew<vtkIdList> cell;
  for (vtkIdType id = 0; id < grid.GetNumberOfCells(); ++id) {
    if (grid.GetCellType(id) != VTK_TETRA) continue;
    grid.GetCellPoints(id, cell);
    rows += std::to_string(count++);
    for (vtkIdType corner = 0; corner < 4; ++corner) {
      rows += ' ' + std::to_string(cell->GetId(corner));
    }
    columns.append_row(rows, id);
    rows += '\n';
  }
  return std::to_string(count) + " 4 " + std::to_string(columns.attributes.size()) + '\n' + rows;
}

}  // namespace

std::vector<std::pair<path, path>> written_files(const path& partial, const path& target) {
  const std::string extension = extension_of(target);
  if (extension != ".node" && extension != ".ele") return {{partial, target}};
  return {{with_extension(partial, ".node"), with_extension(target, ".node")},
          {with_extension(partial, ".ele"), with_extension(target, ".ele")}};
}

MeshFile read_tetgen(const path& file) {
  FileContent content;
  content.extension = ".node";
  content.dataset = vtkSmartPointer<vtkUnstructuredGrid>::New();
  read_nodes(with_extension(file, ".node"), content);
  const auto ids = read_tetrahedra(with_extension(file, ".ele"), content);
  return make_mesh_file(file, std::move(content), ids);
}

void write_tetgen(const path& file, const MeshFile& mesh_file) {
  const path node_file = with_extension(file, ".node");
  const path element_file = with_extension(file, ".ele");
  if (mesh_file.content() && mesh_file.content()->extension == ".node") {
    const FileContent& content = *mesh_file.content();
    write_bytes(node_file,
                replace_coordinates(content.text, content.fields, mesh_file.mesh.positions_view()));
    write_bytes(element_file, content.companion_text);
    return;
  }
  for (const ElementBlock& block : mesh_file.mesh.blocks) {
    if (block.type != ElementType::tetrahedron) {
      fail("ELEMENT_NOT_SUPPORTED", file,
           "TetGen files cannot carry a " + std::string(element_shape(block.type).name));
    }
  }
  const auto grid = moved_grid(mesh_file);
  write_bytes(node_file, make_node_text(*grid));
  write_bytes(element_file, make_element_text(*grid));
}

}  // namespace meshsmooth::formats

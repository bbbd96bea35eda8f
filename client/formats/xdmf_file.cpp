#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "cell_list.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "xdmf_cells.hpp"
#include "xdmf_data.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

void find_grids(const XmlElement& parent, std::vector<XmlElement>& grids) {
  for (const XmlElement& grid : parent.children("Grid")) {
    grids.push_back(grid);
    find_grids(grid, grids);
  }
}

bool has(const XmlElement& grid, const char* name) { return !grid.children(name).empty(); }

/// The one grid with nodes and elements of its own. Others may hang on it.
XmlElement find_mesh(const XdmfData& data, const std::vector<XmlElement>& grids) {
  std::vector<XmlElement> meshes;
  std::string list;
  for (const XmlElement& grid : grids) {
    if (!has(grid, "Geometry") || !has(grid, "Topology")) continue;
    meshes.push_back(grid);
    list += (list.empty() ? "\"" : ", \"") + grid.attribute("Name") + "\"";
  }
  if (meshes.empty()) data.fail("there is no <Grid> with a <Geometry> and a <Topology> in it");
  if (meshes.size() > 1) {
    data.fail("only a file with one mesh can be smoothed; this one has " +
              std::to_string(meshes.size()) + ": " + list);
  }
  return meshes.front();
}

/// Numbers in the text get other ones there, so it must be clear where they stand.
void find_fields(const path& path, const XmlElement& item, FileContent& content) {
  const std::string& text = content.text;
  const std::string numbers = item.content();
  const std::size_t first = numbers.empty() ? std::string::npos : text.find(numbers);
  if (first == std::string::npos || text.find(numbers, first + 1) != std::string::npos) {
    fail("FORMAT_ERROR", path, "the coordinates in the XML are not there exactly once");
  }
  const std::size_t end = first + numbers.size();
  Scanner scanner(path, std::string_view(text).substr(0, end));
  (void)scanner.bytes(first);
  while (!scanner.at_end()) {
    std::array<double, 3> values{};
    std::array<CoordinateFields::Field, 3> fields = {{{end, 0}, {end, 0}, {end, 0}}};
    for (std::size_t axis = 0; axis < content.arrays.dimension; ++axis) {
      const std::string_view word = scanner.token();
      values[axis] = scanner.parse<double>(word);
      fields[axis] = {scanner.offset_of(word), word.size()};
    }
    content.fields.fields.push_back(fields);
    content.fields.positions.push_back({values[0], values[1], values[2]});
  }
}

void read_nodes(XdmfData& data, const path& path, const XmlElement& grid, FileContent& content,
                PlainDataset& dataset) {
  const XmlElement geometry = grid.children("Geometry").front();
  std::string type = geometry.attribute("GeometryType");
  if (type.empty()) type = geometry.attribute("Type");
  if (type.empty()) type = "XYZ";
  if (type != "XYZ" && type != "XY") {
    data.fail("the geometry is of the type \"" + type + "\"; XYZ and XY can be read");
  }
  const XmlElement item = data.item_of(geometry);
  content.arrays.dimension = type.size();
  content.arrays.by_axis = false;
  const XdmfData::Reference where = data.reference(item);
  if (where.file.empty()) {
    content.arrays.names = {"<Geometry>"};
    find_fields(path, item, content);
    dataset.set_positions(content.fields.positions);
    return;
  }
  content.companion = where.file;
  content.companion_text = data.bytes(where.file);
  content.arrays.names = {where.dataset};
  content.arrays.single_precision = data.hdf5(where.file).is_single_precision(where.dataset);
  dataset.set_positions(positions_of(path, content.arrays, {data.reals(item)}));
}

/// One number a node or cell; what else hangs on the mesh stays in the file.
void read_columns(XdmfData& data, const XmlElement& grid, PlainDataset& dataset) {
  for (const XmlElement& attribute : grid.children("Attribute")) {
    const std::string type = attribute.attribute("AttributeType");
    const std::string location = attribute.attribute("Center");
    const bool on_cells = location == "Cell";
    if ((!type.empty() && type != "Scalar") ||
        (!on_cells && !location.empty() && location != "Node")) {
      continue;
    }
    const XmlElement item = data.item_of(attribute);
    Column column{attribute.attribute("Name"), data.is_whole(item), data.reals(item)};
    const std::int64_t count = on_cells ? dataset.cell_count() : dataset.node_count();
    if (static_cast<std::int64_t>(column.values.size()) != count) {
      data.fail("the attribute \"" + column.name + "\" has " +
                std::to_string(column.values.size()) + " numbers for " + std::to_string(count) +
                (on_cells ? " cells" : " nodes"));
    }
    if (on_cells) {
      dataset.add_cell_column(std::move(column));
    } else {
      dataset.add_node_column(std::move(column));
    }
  }
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char letter : text) {
    result += letter == '&'   ? "&amp;"
              : letter == '<' ? "&lt;"
              : letter == '>' ? "&gt;"
                              : std::string(1, letter);
  }
  return result;
}

/// Names of HDF5 files as they stand in the text, before ":/".
struct Name {
  std::size_t first;
  std::string_view text;
};

std::vector<Name> find_names(std::string_view text) {
  std::vector<Name> names;
  for (std::size_t end = text.find(":/"); end != std::string_view::npos;
       end = text.find(":/", end + 1)) {
    const std::size_t tag = text.find_last_of("<>", end);
    if (tag == std::string_view::npos || text[tag] == '<') continue;  // within a tag
    const std::size_t start = text.find_last_of(">\r\n", end);
    const std::size_t first = text.find_first_not_of(" \t", start + 1);
    if (first < end) names.push_back({first, text.substr(first, end - first)});
  }
  return names;
}

/// With `companion` in place of the file that holds the coordinates; others are found from the
/// new folder.
std::string rename_files(const std::string& text, const FileContent& content,
                         const std::string& companion, const path& folder) {
  std::string result;
  std::size_t copied = 0;
  const std::string old_name = escaped(content.companion.string());
  for (const Name& name : find_names(text)) {
    const path other(name.text);
    std::string now = name.text == old_name ? escaped(companion) : std::string(name.text);
    if (name.text != old_name && other.is_relative()) {
      now = std::filesystem::proximate(content.folder / other, folder).string();
    }
    result.append(text, copied, name.first - copied).append(now);
    copied = name.first + name.text.size();
  }
  return result.append(text, copied);
}

}  // namespace

MeshFile read_xdmf(const path& path) {
  FileContent content;
  content.extension = ".xdmf";
  content.text = read_bytes(path);
  content.folder = std::filesystem::absolute(path).parent_path();
  XdmfData data(path, content.text);
  std::vector<XmlElement> grids;
  for (const XmlElement& domain : data.root().children("Domain")) find_grids(domain, grids);
  const XmlElement mesh = find_mesh(data, grids);

  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(data, path, mesh, content, *dataset);
  CellList cells;
  read_xdmf_cells(data, path, mesh, cells);
  cells.store(*dataset);
  read_columns(data, mesh, *dataset);
  for (const XmlElement& grid : grids) {
    if (has(grid, "Topology") && !has(grid, "Geometry")) {
      read_xdmf_tags(data, path, grid, content, *dataset);
    }
  }
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_xdmf(const path& target, const MeshFile& mesh_file, OutputFiles& files) {
  const FileContent& content = *mesh_file.content();
  const path folder = std::filesystem::absolute(target).parent_path();
  const path companion = path(target).replace_extension(".h5");
  std::string text = content.text;
  if (content.companion.empty()) {
    // z is not in the text of a flat mesh, and rounding may have left something there.
    const auto numbers = numbers_of(target, content.arrays, mesh_file.mesh.positions_view());
    const Positions positions = positions_of(target, content.arrays, numbers);
    const auto view =
        std::visit([](const auto& nodes) -> PositionsView { return std::span(nodes); }, positions);
    text = replace_coordinates(text, content.fields, view);
  } else {
    write_hdf5(files.add(companion), content.companion_text, mesh_file);
  }
  write_bytes(files.add(target),
              rename_files(text, content, companion.filename().string(), folder));
}

}  // namespace meshsmooth::formats

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "cell_list.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"
#include "xdmf/cells.hpp"
#include "xdmf/data.hpp"
#include "xdmf/grids.hpp"
#include "xdmf/nodes.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// All grids of a file as one mesh.
class GridReader {
 public:
  GridReader(XdmfData& data, const path& path, FileContent& content)
      : data_(data), path_(path), content_(content), nodes_(data, path, content) {}

  std::shared_ptr<PlainDataset> read() {
    const std::vector<XdmfGrid> grids = find_xdmf_grids(data_);
    for (const bool included : {false, true}) {  // others' nodes after these
      for (const XdmfGrid& grid : grids) {
        if (!grid.topology || grid.included_geometry != included) continue;
        if (grid.geometry) read_grid(grid);
        if (!grid.geometry) tags_.push_back({&grid, std::nullopt});
      }
    }
    if (meshes_.empty()) {
      data_.fail("there is no <Grid> with a <Geometry> and a <Topology> in it");
    }
    const auto dataset = std::make_shared<PlainDataset>();
    nodes_.store(*dataset);
    cells_.store(*dataset);
    name_grids(*dataset);
    read_columns(*dataset);
    for (const auto& [grid, nodes] : tags_) read_tags(*grid, nodes, *dataset);
    return dataset;
  }

 private:
  struct MeshGrid {
    const XdmfGrid* grid;
    XdmfNodes nodes;
    XdmfTopology topology;
    std::size_t first_cell;
    std::size_t cell_count;
  };
  struct Tags {
    const XdmfGrid* grid;
    std::optional<XdmfNodes> nodes;  // none: the mesh's
  };

  void read_grid(const XdmfGrid& grid) {
    XdmfTopology topology = read_xdmf_topology(data_, path_, *grid.topology, grid.name());
    std::optional<XdmfNodes> nodes = nodes_.find(*grid.geometry);
    if (nodes) {
      if (grid.included_geometry && !grid.element.children("Topology").empty()) {
        tags_.push_back({&grid, nodes});
        return;
      }
      if (find_mesh(*nodes, topology) != nullptr) {
        check_steps(grid, *nodes, topology);
        return;
      }
    } else {
      const auto numbers = nodes_.numbers(*grid.geometry);
      for (const MeshGrid& mesh : meshes_) {
        if (!nodes_.have(mesh.nodes, numbers) || !(mesh.topology == topology)) continue;
        nodes_.add_copy(*grid.geometry, mesh.nodes, numbers);
        check_steps(grid, mesh.nodes, topology);
        return;
      }
      nodes = nodes_.add(*grid.geometry, numbers);
    }
    const std::size_t before = cells_.size();
    read_xdmf_cells(data_, path_, topology, *nodes, cells_);
    check_steps(grid, *nodes, topology);
    meshes_.push_back({&grid, *nodes, std::move(topology), before, cells_.size() - before});
  }

  [[nodiscard]] const MeshGrid* find_mesh(const XdmfNodes& nodes,
                                          const XdmfTopology& topology) const {
    const auto found = std::ranges::find_if(meshes_, [&](const MeshGrid& mesh) {
      return mesh.nodes.first == nodes.first && mesh.topology == topology;
    });
    return found == meshes_.end() ? nullptr : &*found;
  }

  /// At all later steps the mesh must be the same, be it the same arrays or equal ones, which then
  /// change with it.
  void check_steps(const XdmfGrid& first, const XdmfNodes& nodes, const XdmfTopology& topology) {
    for (const XdmfGrid& grid : first.later) {
      const bool same_topology =
          !grid.topology || *grid.topology == *first.topology ||
          read_xdmf_topology(data_, path_, *grid.topology, grid.name()) == topology;
      if (!same_topology) {
        data_.fail("the grid \"" + grid.name() +
                   "\" has other elements at a later time step; only a mesh that stays the same "
                   "can be smoothed");
      }
      if (!grid.geometry) continue;
      if (const auto known = nodes_.find(*grid.geometry)) {
        if (known->first == nodes.first) continue;
      }
      const auto numbers = nodes_.numbers(*grid.geometry);
      if (!nodes_.have(nodes, numbers)) {
        data_.fail("the grid \"" + grid.name() +
                   "\" has its nodes elsewhere at a later time step; only a mesh that stays the "
                   "same can be smoothed");
      }
      nodes_.add_copy(*grid.geometry, nodes, numbers);
    }
  }

  /// A cell array and groups by which the grids are known, where there are several.
  void name_grids(PlainDataset& dataset) {
    if (meshes_.size() < 2) return;
    Column column{kGridArray, true, {}};
    Cell cell;
    for (std::size_t index = 0; index < meshes_.size(); ++index) {
      const MeshGrid& mesh = meshes_[index];
      std::set<int> dimensions;
      for (std::size_t id = mesh.first_cell; id < mesh.first_cell + mesh.cell_count; ++id) {
        dataset.get_cell(static_cast<std::int64_t>(id), cell);
        dimensions.insert(cell_dimension(cell.type, cell.nodes.size()).value_or(3));
      }
      const int number = static_cast<int>(index) + 1;
      column.values.resize(column.values.size() + mesh.cell_count, number);
      for (const int dimension : dimensions) {
        content_.groups.push_back({dimension, mesh.grid->name(), kGridArray, {number}});
      }
    }
    dataset.add_cell_column(std::move(column));
  }

  /// One number a node or cell, 0 in other grids; what else hangs on the mesh stays in the file.
  void read_columns(PlainDataset& dataset) {
    std::map<std::pair<bool, std::string>, Column> columns;
    for (const MeshGrid& mesh : meshes_) {
      for (const XmlElement& attribute : mesh.grid->element.children("Attribute")) {
        read_column(mesh, attribute, dataset, columns);
      }
    }
    for (auto& [key, column] : columns) {
      if (key.first) {
        dataset.add_cell_column(std::move(column));
      } else {
        dataset.add_node_column(std::move(column));
      }
    }
  }

  void read_column(const MeshGrid& mesh, const XmlElement& attribute, const PlainDataset& dataset,
                   std::map<std::pair<bool, std::string>, Column>& columns) {
    const std::string type = attribute.attribute("AttributeType");
    const std::string location = attribute.attribute("Center");
    const bool on_cells = location == "Cell";
    if ((!type.empty() && type != "Scalar") ||
        (!on_cells && !location.empty() && location != "Node")) {
      return;
    }
    const XmlElement item = data_.item_of(attribute);
    const std::vector<double> values = data_.reals(item);
    const std::string name = attribute.attribute("Name");
    const std::size_t count =
        on_cells ? mesh.cell_count : static_cast<std::size_t>(mesh.nodes.count);
    if (values.size() != count) {
      data_.fail("the attribute \"" + name + "\" has " + std::to_string(values.size()) +
                 " numbers for " + std::to_string(count) + (on_cells ? " cells" : " nodes"));
    }
    Column& column = columns.try_emplace({on_cells, name}, Column{name, true, {}}).first->second;
    column.whole = column.whole && data_.is_whole(item);
    column.values.resize(
        static_cast<std::size_t>(on_cells ? dataset.cell_count() : dataset.node_count()));
    const std::size_t first =
        on_cells ? mesh.first_cell : static_cast<std::size_t>(mesh.nodes.first);
    std::ranges::copy(values, column.values.begin() + static_cast<std::ptrdiff_t>(first));
  }

  void read_tags(const XdmfGrid& grid, std::optional<XdmfNodes> nodes, PlainDataset& dataset) {
    if (!nodes) nodes = XdmfNodes{0, dataset.node_count()};
    CellList list;
    read_xdmf_cells(data_, path_, read_xdmf_topology(data_, path_, *grid.topology, grid.name()),
                    *nodes, list);
    PlainDataset tagged;
    tagged.set_positions(Positions{});
    list.store(tagged);
    read_xdmf_tags(data_, grid.element, tagged, content_, dataset);
  }

  XdmfData& data_;
  const path& path_;
  FileContent& content_;
  XdmfNodeReader nodes_;
  CellList cells_;
  std::vector<MeshGrid> meshes_;
  std::vector<Tags> tags_;
};

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

/// Those in the <DataItem> elements with Format="HDF".
std::vector<Name> find_names(std::string_view text) {
  std::vector<Name> names;
  for (std::size_t at = text.find("<DataItem"); at != std::string_view::npos;
       at = text.find("<DataItem", at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string_view::npos) break;
    std::string tag(text.substr(at, end - at));
    std::ranges::transform(tag, tag.begin(), [](unsigned char c) { return std::toupper(c); });
    if (tag.find("HDF") == std::string::npos) continue;
    const std::string_view content =
        without_space(text.substr(end + 1, text.find('<', end) - end - 1));
    const std::size_t separator = find_hdf5_separator(content);
    if (separator == std::string_view::npos) continue;
    names.push_back(
        {static_cast<std::size_t>(content.data() - text.data()), content.substr(0, separator)});
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
  content.dataset = GridReader(data, path, content).read();
  return make_mesh_file(path, std::move(content));
}

void write_xdmf(const path& target, const MeshFile& mesh_file, OutputFiles& files) {
  const FileContent& content = *mesh_file.content();
  const path folder = std::filesystem::absolute(target).parent_path();
  const path companion = path(target).replace_extension(".h5");
  std::string text = content.text;
  if (content.companion.empty()) {
    text = replace_xdmf_coordinates(target, content, mesh_file.mesh);
  } else {
    write_hdf5(files.add(companion), content.companion_text, mesh_file);
  }
  write_bytes(files.add(target),
              rename_files(text, content, companion.filename().string(), folder));
}

}  // namespace meshsmooth::formats

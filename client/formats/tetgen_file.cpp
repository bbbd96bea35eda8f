#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <unordered_map>

#include "content.hpp"
#include "node_orders.hpp"
#include "notes.hpp"
#include "readers.hpp"
#include "self_contained.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// In capitals where the file's own is.
path with_extension(path file, const char* extension) {
  const bool capitals = file.extension() == ".NODE" || file.extension() == ".ELE";
  if (!capitals) return file.replace_extension(extension);
  return file.replace_extension(std::string_view(extension) == ".ele" ? ".ELE" : ".NODE");
}

/// A number of the first line, which may leave out those at its end.
std::size_t header_number(Scanner& scanner, std::size_t otherwise) {
  const std::string_view word = scanner.token_on_line();
  return word.empty() ? otherwise : scanner.parse<std::size_t>(word);
}

/// The next word of this line, which must have one.
std::string_view needed_word(Scanner& scanner) {
  const std::string_view word = scanner.token_on_line();
  if (word.empty() && scanner.at_end()) scanner.truncated();
  if (word.empty()) scanner.refuse("more numbers in the line before", word);
  return word;
}

/// TetGen reads line by line, and no further than the header tells.
void finish_row(Scanner& scanner, std::int64_t id, const char* what, Notes& notes) {
  if (scanner.token_on_line().empty()) return;
  scanner.line();
  notes.add(what, [&] {
    return std::string(what) + " " + std::to_string(id) +
           " has more numbers than the first line announces, which are ignored";
  });
}

void note_rest(Scanner& scanner, const path& file, Notes& notes) {
  if (scanner.at_end()) return;
  notes.add(file.extension() == ".node" ? "nodes" : "elements", [&] {
    return file.string() +
           ": the lines after the last one that the first line announces are ignored";
  });
}

/// The file of the pair with this extension, which may be in capitals as the other's.
path of_pair(const path& file, const char* extension) {
  const std::string own = extension_of(file);
  if (own == extension) return file;
  if (own != ".node" && own != ".ele") {
    fail("FORMAT_UNKNOWN", file, "TetGen's files are told apart by their names, .node and .ele");
  }
  path found = with_extension(file, extension);
  check_reference(file, found.filename().string());
  const path folder = file.has_parent_path() ? file.parent_path() : path(".");
  std::error_code error;
  if (std::filesystem::exists(found, error)) return found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const path name = entry.path().filename();
    if (name.stem() == file.stem() && extension_of(name) == extension) {
      return file.parent_path() / name;
    }
  }
  return found;
}

/// Columns of attributes, and a column of markers, of nodes or tetrahedra.
struct Columns {
  std::vector<Column> all;

  Columns(std::size_t attribute_count, bool has_markers) {
    for (std::size_t index = 0; index < attribute_count; ++index) {
      all.push_back({kAttributeArray + std::to_string(index), false, {}});
    }
    if (has_markers) all.push_back({kMarkerArray, true, {}});
  }
  /// What a line leaves out at its end is 0, as TetGen has it.
  void read_row(Scanner& scanner, std::int64_t id, Notes& notes) {
    for (Column& column : all) {
      const std::string_view word = scanner.token_on_line();
      double value = 0;
      if (!word.empty()) {
        value = column.whole ? scanner.parse<int>(word) : scanner.parse<double>(word);
      } else {
        notes.add("fewer", [&] {
          return "node or element " + std::to_string(id) +
                 " has fewer numbers than the first line announces; 0 is taken";
        });
      }
      column.values.push_back(value);
    }
  }
};

void read_nodes(const path& file, FileContent& content, PlainDataset& dataset, Notes& notes) {
  content.text = read_bytes(file);
  Scanner scanner(file, content.text, '#');
  const std::size_t count = scanner.count();
  const std::size_t dimension = header_number(scanner, 3);
  if (dimension == 2) scanner.refuse("a mesh of TetGen in three dimensions", "2, as of Triangle");
  if (dimension != 3) scanner.refuse("dimension 3", std::to_string(dimension));
  const std::size_t attribute_count = header_number(scanner, 0);
  if (attribute_count > content.text.size()) scanner.truncated();
  Columns columns(attribute_count, header_number(scanner, 0) != 0);
  for (std::size_t row = 0; row < count; ++row) {
    const auto id = scanner.number<std::int64_t>();
    const std::string_view x = needed_word(scanner);
    const std::string_view y = needed_word(scanner);
    const std::string_view z = needed_word(scanner);
    content.fields.add(id, {x, y, z}, scanner);
    columns.read_row(scanner, id, notes);
    finish_row(scanner, id, "node", notes);
  }
  note_rest(scanner, file, notes);
  content.node_ids = content.fields.node_ids;
  dataset.set_positions(content.fields.positions);
  for (Column& column : columns.all) dataset.add_node_column(std::move(column));
}

std::vector<std::int64_t> read_tetrahedra(const path& file, FileContent& content,
                                          PlainDataset& dataset, Notes& notes) {
  content.companion_text = read_bytes(file);
  Scanner scanner(file, content.companion_text, '#');
  const std::size_t count = scanner.count();
  const std::size_t width = header_number(scanner, 4);
  if (width != 4 && width != 10) {
    fail("ELEMENT_NOT_SUPPORTED", file,
         "its elements have " + std::to_string(width) +
             " nodes; only tetrahedra with 4 or 10 nodes can be smoothed");
  }
  const CellKind& kind =
      cell_kind(width == 4 ? ElementType::tetrahedron : ElementType::tetrahedron10);
  const auto places = places_in(NodeOrder::tetgen, kind);
  const std::size_t attribute_count = header_number(scanner, 0);
  if (attribute_count > content.companion_text.size()) scanner.truncated();
  Columns columns(attribute_count, false);
  std::unordered_map<std::int64_t, std::int64_t> nodes;
  nodes.reserve(content.node_ids.size());
  for (const std::int64_t id : content.node_ids) {
    if (!nodes.emplace(id, static_cast<std::int64_t>(nodes.size())).second) {
      fail("FORMAT_ERROR", of_pair(file, ".node"),
           "two nodes have the number " + std::to_string(id));
    }
  }

  std::vector<std::int64_t> ids;
  for (std::size_t row = 0; row < count; ++row) {
    ids.push_back(scanner.number<std::int64_t>());
    std::array<std::int64_t, 10> own{};  // in TetGen's order
    for (std::size_t place = 0; place < width; ++place) {
      const std::string_view word = needed_word(scanner);
      const auto found = nodes.find(scanner.parse<std::int64_t>(word));
      if (found == nodes.end()) scanner.refuse("the number of a node in the .node file", word);
      own[place] = found->second;
    }
    std::array<std::int64_t, 10> cell{};
    for (std::size_t node = 0; node < width; ++node) {
      cell[node] = own[static_cast<std::size_t>(places[node])];
    }
    dataset.add_cell(kind.vtk_type, std::span(cell).first(width));
    columns.read_row(scanner, ids.back(), notes);
    finish_row(scanner, ids.back(), "element", notes);
  }
  note_rest(scanner, file, notes);
  for (Column& column : columns.all) dataset.add_cell_column(std::move(column));
  return ids;
}

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text += ' ';
  text.append(digits.data(), end);
}

/// Columns become attributes, that of the markers the marker.
struct OutputColumns {
  std::vector<Column> attributes;
  std::optional<Column> markers;

  explicit OutputColumns(std::vector<Column> columns) {
    for (Column& column : columns) {
      if (column.name == kMarkerArray) {
        markers = std::move(column);
      } else if (column.name != kNodeIdArray && column.name != kElementIdArray) {
        attributes.push_back(std::move(column));
      }
    }
  }
  void append_row(std::string& text, std::size_t row) const {
    for (const Column& column : attributes) append(text, column.values[row]);
    if (markers) append(text, markers->values[row]);
  }
};

std::string make_node_text(const Dataset& dataset, const Mesh& mesh) {
  const OutputColumns columns(dataset.node_columns());
  std::string text = std::to_string(mesh.node_count()) + " 3 " +
                     std::to_string(columns.attributes.size()) +
                     (columns.markers ? " 1\n" : " 0\n");
  std::visit(
      [&](const auto& nodes) {
        for (std::size_t node = 0; node < nodes.size(); ++node) {
          text += std::to_string(node);
          const Vec3d place = vec3_cast<double>(nodes[node]);
          for (const double value : {place.x, place.y, place.z}) append(text, value);
          columns.append_row(text, node);
          text += '\n';
        }
      },
      mesh.positions);
  return text;
}

/// Of all tetrahedra of a kind.
std::string make_element_text(const Dataset& dataset, const CellKind& kind) {
  const auto places = places_in(NodeOrder::tetgen, kind);
  OutputColumns columns(dataset.cell_columns());
  columns.markers.reset();  // .ele files have none
  std::string rows;
  std::size_t count = 0;
  Cell cell;
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    if (cell.type != kind.vtk_type) continue;
    rows += std::to_string(count++);
    std::array<std::int64_t, 10> own{};
    for (std::size_t node = 0; node < cell.nodes.size(); ++node) {
      own[static_cast<std::size_t>(places[node])] = cell.nodes[node];
    }
    for (const std::int64_t node : std::span(own).first(cell.nodes.size())) {
      rows += ' ' + std::to_string(node);
    }
    columns.append_row(rows, static_cast<std::size_t>(id));
    rows += '\n';
  }
  return std::to_string(count) + ' ' + std::to_string(kind.node_count) + ' ' +
         std::to_string(columns.attributes.size()) + '\n' + rows;
}

}  // namespace

MeshFile read_tetgen(const path& file) {
  FileContent content;
  content.extension = ".node";
  const auto dataset = std::make_shared<PlainDataset>();
  Notes notes;
  read_nodes(of_pair(file, ".node"), content, *dataset, notes);
  content.cell_ids = read_tetrahedra(of_pair(file, ".ele"), content, *dataset, notes);
  content.notes = notes.texts();
  content.dataset = dataset;
  return make_mesh_file(file, std::move(content));
}

void write_tetgen(const path& file, const MeshFile& mesh_file, OutputFiles& files) {
  const path node_file = files.add(of_pair(file, ".node"));
  const path element_file = files.add(of_pair(file, ".ele"));
  if (mesh_file.content() && mesh_file.content()->extension == ".node") {
    const FileContent& content = *mesh_file.content();
    write_bytes(node_file,
                replace_coordinates(content.text, content.fields, mesh_file.mesh.positions_view()));
    write_bytes(element_file, content.companion_text);
    return;
  }
  const ElementType type = mesh_file.mesh.blocks.front().type;
  for (const ElementBlock& block : mesh_file.mesh.blocks) {
    if (linear_type(block.type) != ElementType::tetrahedron || block.type != type) {
      fail("ELEMENT_NOT_SUPPORTED", file,
           "TetGen files cannot carry a " + std::string(element_name(block.type)));
    }
  }
  check_held_cells(file, mesh_file, {});
  const std::shared_ptr<const Dataset> dataset = dataset_of(mesh_file);
  write_bytes(node_file, make_node_text(*dataset, mesh_file.mesh));
  write_bytes(element_file, make_element_text(*dataset, cell_kind(type)));
}

}  // namespace meshsmooth::formats

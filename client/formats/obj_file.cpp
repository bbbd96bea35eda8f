#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "cells.hpp"
#include "content.hpp"
#include "notes.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// VTK's reader splits nodes where texture coordinates differ, which tears the
// surface; and everything but nodes and faces would be lost. So the lines are
// kept, and nodes and faces picked from them.

constexpr auto kFreeForms =
    std::to_array<std::string_view>({"curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp"});

/// "7/1/3" or "-1//2" to a node; negative numbers count back from the last.
std::int64_t parse_corner(const Scanner& scanner, std::string_view word, std::size_t node_count) {
  const auto number = scanner.parse<std::int64_t>(word.substr(0, word.find('/')));
  const auto count = static_cast<std::int64_t>(node_count);
  const std::int64_t node = number < 0 ? count + number : number - 1;
  if (number == 0 || node < 0) scanner.refuse("a node number", word);
  return node;
}

/// The next word of this line, and of the next where this one ends with a backslash.
std::string_view next_word(Scanner& scanner) {
  std::string_view word = scanner.token_on_line();
  while (word == "\\") {
    scanner.line();
    word = scanner.token_on_line();
  }
  if (!word.ends_with('\\')) return word;
  scanner.line();
  return word.substr(0, word.size() - 1);
}

void read_cell(Scanner& scanner, std::string_view keyword, std::size_t node_count,
               PlainDataset& dataset) {
  std::vector<std::int64_t> nodes;
  for (auto word = next_word(scanner); !word.empty(); word = next_word(scanner)) {
    nodes.push_back(parse_corner(scanner, word, node_count));
  }
  int type = kPolygonCell;
  if (keyword == "p") type = kPolyVertexCell;
  if (keyword == "l") type = kPolyLineCell;
  const std::size_t least = keyword == "p" ? 1 : keyword == "l" ? 2 : 3;
  if (nodes.size() < least) {
    scanner.refuse(std::to_string(least) + " nodes or more after " + std::string(keyword),
                   std::to_string(nodes.size()));
  }
  if (const CellKind* kind = find_vtk_cell(type, nodes.size())) type = kind->vtk_type;
  dataset.add_cell(type, nodes);
}

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text.append(digits.data(), end);
}

/// Nodes, points, lines and faces, polygons among them.
std::string make_obj(const MeshFile& file) {
  std::string text;
  std::visit(
      [&](const auto& nodes) {
        for (const auto& node : nodes) {
          text += 'v';
          for (const double value : {double(node.x), double(node.y), double(node.z)}) {
            text += ' ';
            append(text, value);
          }
          text += '\n';
        }
      },
      file.mesh.positions_view());
  const std::shared_ptr<const Dataset> dataset = dataset_of(file);
  Cell cell;
  for (std::int64_t id = 0; id < dataset->cell_count(); ++id) {
    dataset->get_cell(id, cell);
    const auto dimension = cell_dimension(cell.type, cell.nodes.size());
    if (cell.nodes.empty()) continue;
    if (cell.type == kEdge3Cell) std::swap(cell.nodes[1], cell.nodes[2]);  // along the edge
    text += cell.type == kPolygonCell || dimension == 2 ? 'f' : dimension == 1 ? 'l' : 'p';
    for (const std::int64_t node : cell.nodes) text += ' ' + std::to_string(node + 1);
    text += '\n';
  }
  return text;
}

}  // namespace

MeshFile read_obj(const std::filesystem::path& path) {
  FileContent content;
  content.extension = ".obj";
  content.text = read_bytes(path);
  if (content.text.find('\0') != std::string::npos)
    fail("FORMAT_ERROR", path, "not a text file: it contains NUL bytes");

  const auto dataset = std::make_shared<PlainDataset>();
  Scanner scanner(path, content.text, '#');
  Notes notes;
  std::int64_t node_id = 0;
  while (!scanner.at_end()) {
    const std::string_view keyword = scanner.token_on_line();
    if (keyword == "v") {
      const std::string_view x = next_word(scanner);
      const std::string_view y = next_word(scanner);
      const std::string_view z = next_word(scanner);
      content.fields.add(++node_id, {x, y, z}, scanner);
    } else if (keyword == "f" || keyword == "fo" || keyword == "l" || keyword == "p") {
      read_cell(scanner, keyword, content.fields.positions.size(), *dataset);
    } else if (std::ranges::find(kFreeForms, keyword) != kFreeForms.end()) {
      notes.add("free form", [&] {
        return "free-form geometry (" + std::string(keyword) + ") does not move with the nodes";
      });
    }
    // A line that is not read may go on, too.
    while (trimmed(scanner.peek_line()).ends_with('\\')) scanner.line();
    scanner.line();
  }
  content.notes = notes.texts();
  dataset->set_positions(content.fields.positions);
  content.node_ids = content.fields.node_ids;
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

void write_obj(const std::filesystem::path& path, const MeshFile& file) {
  if (file.content() && file.content()->extension == ".obj") {
    write_bytes(path, replace_coordinates(file.content()->text, file.content()->fields,
                                          file.mesh.positions_view()));
    return;
  }
  for (const ElementBlock& block : file.mesh.blocks) {
    if (element_shape(block.type).dimension == 3 || is_second_order(block.type)) {
      fail("ELEMENT_NOT_SUPPORTED", path,
           ".obj files cannot carry a " + std::string(element_name(block.type)));
    }
  }
  check_held_cells(path, file, {kPolygonCell});
  write_bytes(path, make_obj(file));
}

}  // namespace meshsmooth::formats

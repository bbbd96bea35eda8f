#include <charconv>

#include "cells.hpp"
#include "content.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

// VTK's reader splits nodes where texture coordinates differ, which tears the
// surface; and everything but nodes and faces would be lost. So the lines are
// kept, and nodes and faces picked from them.

/// "7/1/3" or "-1//2" to a node; negative numbers count back from the last.
std::int64_t parse_corner(const Scanner& scanner, std::string_view word, std::size_t node_count) {
  const auto number = scanner.parse<std::int64_t>(word.substr(0, word.find('/')));
  const auto count = static_cast<std::int64_t>(node_count);
  const std::int64_t node = number < 0 ? count + number : number - 1;
  if (number == 0 || node < 0) scanner.refuse("a node number", word);
  return node;
}

void read_cell(Scanner& scanner, std::string_view keyword, std::size_t node_count,
               PlainDataset& dataset) {
  std::vector<std::int64_t> nodes;
  for (auto word = scanner.token_on_line(); !word.empty(); word = scanner.token_on_line()) {
    nodes.push_back(parse_corner(scanner, word, node_count));
  }
  int type = kPolygonCell;
  if (keyword == "p") type = kPolyVertexCell;
  if (keyword == "l") type = kPolyLineCell;
  if (keyword == "f" && nodes.size() < 3) scanner.refuse("three nodes or more", "fewer");
  if (const CellKind* kind = find_vtk_cell(type, nodes.size())) type = kind->vtk_type;
  dataset.add_cell(type, nodes);
}

void append(std::string& text, double number) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  text.append(digits.data(), end);
}

std::string make_obj(const Mesh& mesh) {
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
      mesh.positions_view());
  for (const ElementBlock& block : mesh.blocks) {
    const auto corners = element_width(block.type);
    for (std::size_t corner = 0; corner < block.nodes.size(); ++corner) {
      text += corner % corners == 0 ? "f " : " ";
      text += std::to_string(block.nodes[corner] + 1);
      if (corner % corners == corners - 1) text += '\n';
    }
  }
  return text;
}

}  // namespace

MeshFile read_obj(const std::filesystem::path& path) {
  FileContent content;
  content.extension = ".obj";
  content.text = read_bytes(path);
  if (content.text.find('\0') != std::string::npos) fail("FORMAT_ERROR", path, "this is no text");

  const auto dataset = std::make_shared<PlainDataset>();
  Scanner scanner(path, content.text, '#');
  std::int64_t node_id = 0;
  while (!scanner.at_end()) {
    const std::string_view keyword = scanner.token_on_line();
    if (keyword == "v") {
      const std::string_view x = scanner.token_on_line();
      const std::string_view y = scanner.token_on_line();
      const std::string_view z = scanner.token_on_line();
      content.fields.add(++node_id, {x, y, z}, scanner);
    } else if (keyword == "f" || keyword == "l" || keyword == "p") {
      read_cell(scanner, keyword, content.fields.positions.size(), *dataset);
    }
    scanner.line();
  }
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
  write_bytes(path, make_obj(file.mesh));
}

}  // namespace meshsmooth::formats

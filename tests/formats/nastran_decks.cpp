// Reads many Nastran decks in one process and writes them with moved nodes, for
// nastran_peer_test.py. Each line of the input is the path of a deck and that to write, between
// them a tab; for each comes a line of JSON.
#include <cmath>
#include <cstdio>
#include <iostream>
#include <string>

#include "cells.hpp"
#include "content.hpp"
#include "mesh_file.hpp"

namespace {

using namespace meshsmooth;
using formats::MeshFile;

std::string json_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c < ' ' ? ' ' : c;
  }
  return result + '"';
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string positions_of(const MeshFile& file) {
  std::string text;
  const auto& positions = std::get<std::vector<Vec3d>>(file.mesh.positions);
  for (std::size_t node = 0; node < positions.size(); ++node) {
    const auto& [x, y, z] = positions[node];
    text += (node == 0 ? "" : ",") + ("[" + number(x)) + "," + number(y) + "," + number(z) + "]";
  }
  return "[" + text + "]";
}

std::string cells_of(const MeshFile& file) {
  std::string text;
  formats::Cell cell;
  const formats::Dataset& dataset = *file.content()->dataset;
  const auto properties = dataset.cell_column(formats::kEntityArray);
  for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
    dataset.get_cell(id, cell);
    const auto* kind = formats::find_vtk_cell(cell.type, cell.nodes.size());
    const std::string name =
        kind != nullptr ? std::string(kind->name) : dataset.cell_name(cell.type);
    const auto place = static_cast<std::size_t>(id);
    const auto& ids = file.content()->cell_ids;
    text += (id == 0 ? "[" : ",[") + json_text(name) + "," +
            std::to_string(ids.empty() ? id : ids[place]) + "," +
            std::to_string(static_cast<std::int64_t>(properties->values[place])) + ",[";
    for (std::size_t node = 0; node < cell.nodes.size(); ++node) {
      text += (node == 0 ? "" : ",") + std::to_string(file.file_node_id(cell.nodes[node]));
    }
    text += "]]";
  }
  return "[" + text + "]";
}

/// Every third node stays, and so do those that are held.
void move_nodes(MeshFile& file) {
  auto& positions = std::get<std::vector<Vec3d>>(file.mesh.positions);
  for (std::size_t node = 0; node < positions.size(); ++node) {
    if (node % 3 == 0 || (!file.mesh.fixed.empty() && file.mesh.fixed[node] != 0)) continue;
    const double step = std::sin(static_cast<double>(7 * node + 1)) / 3;
    Vec3d& p = positions[node];
    p = {p.x * (1 + step / 100) + step * 1e-3, p.y - step * std::abs(p.y), p.z + step};
  }
}

void handle(const std::string& path, const std::string& target) {
  try {
    MeshFile file = formats::read_mesh_file(path);
    std::string ids;
    for (std::size_t node = 0; node < file.mesh.node_count(); ++node) {
      ids += (node == 0 ? "" : ",") +
             std::to_string(file.file_node_id(static_cast<std::int64_t>(node)));
    }
    std::cout << "{\"ids\":[" << ids << "],\"positions\":" << positions_of(file)
              << ",\"cells\":" << cells_of(file) << ",\"elements\":" << file.mesh.element_count();
    if (!target.empty()) {
      move_nodes(file);
      formats::write_mesh_file(target, file);
      std::cout << ",\"moved\":" << positions_of(file)
                << ",\"again\":" << positions_of(formats::read_mesh_file(target));
    }
    std::cout << "}\n";
  } catch (const Error& error) {
    std::cout << "{\"reason\":" << json_text(error.reason())
              << ",\"error\":" << json_text(error.what()) << "}\n";
  }
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    const std::size_t tab = std::min(line.find('\t'), line.size());
    handle(line.substr(0, tab), line.substr(std::min(tab + 1, line.size())));
  }
  return 0;
}

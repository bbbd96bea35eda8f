#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>

#include "content.hpp"
#include "fuzz/choices.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/mesh.hpp"
#include "node_sets.hpp"
#include "readers.hpp"
#include "regions.hpp"
#include "text.hpp"

namespace meshsmooth::testing {

/// Wedges of second order are seen from the other side where most are inverted.
template <class Other>
bool has_nodes(ElementType type, std::span<const NodeId> nodes, std::span<const Other> others) {
  if (type == ElementType::wedge15 || type == ElementType::wedge18) {
    return std::ranges::is_permutation(nodes, others);
  }
  return std::ranges::equal(nodes, others);
}

/// What the mesh says is what the file says; whether it is valid is another question.
inline void check_mesh(const formats::MeshFile& file) {
  const Mesh& mesh = file.mesh;
  const formats::Dataset& dataset = *file.content()->dataset;
  require(mesh.node_count() == static_cast<std::size_t>(dataset.node_count()), "all nodes");
  try {
    validate(MeshTopology(mesh).view(), mesh.positions_view());
  } catch (const InvalidMesh&) {
  }
  std::size_t element = 0;
  formats::Cell cell;
  for (const ElementBlock& block : mesh.blocks) {
    const auto corners = element_width(block.type);
    for (std::size_t first = 0; first < block.nodes.size(); first += corners, ++element) {
      dataset.get_cell(file.content()->element_cells.at(element), cell);
      require(cell.nodes.size() == corners, "a cell has the corners of its element");
      require(has_nodes(block.type, std::span(block.nodes).subspan(first, corners),
                        std::span<const std::int64_t>(cell.nodes)),
              "an element has the nodes that the file says");
    }
  }
  require(element == mesh.element_count(), "all elements");
  for (const NodeId node : file.lower_dimensional_nodes()) {
    require(static_cast<std::size_t>(node) < mesh.node_count(),
            "lower-dimensional cells sit on nodes");
  }
  std::set<std::int64_t> ids;
  for (std::size_t node = 0; node < mesh.node_count(); ++node) {
    const auto id = file.file_node_id(static_cast<std::int64_t>(node));
    require(ids.insert(id).second, "one node for each id");
    require(file.find_node(id) == static_cast<NodeId>(node), "a node is found by its id");
  }
}

/// Every name that the file has, as --fixed-set and --regions ask for it.
inline void ask_for_names(const formats::MeshFile& file) {
  const formats::Dataset& dataset = *file.content()->dataset;
  const auto tried = [](const auto& ask) {
    try {
      ask();
    } catch (const InvalidOption&) {
    }
  };
  for (const formats::Column& column : dataset.node_columns()) {
    tried([&] { (void)formats::find_node_set(file, column.name); });
  }
  for (const formats::Column& column : dataset.cell_columns()) {
    tried([&] { (void)formats::find_regions(file, column.name); });
  }
  tried([&] { (void)formats::find_regions(file); });
  tried([&] { (void)formats::find_node_set(file, "no such set"); });
}

/// Moves nodes as smoothing would; the first stays.
inline void move_nodes(Mesh& mesh) {
  std::visit(
      [](auto& positions) {
        for (std::size_t node = 1; node < positions.size(); ++node) {
          positions[node].x = -1.0F / static_cast<float>(node);
          positions[node].y = 1e-30F;
        }
      },
      mesh.positions);
}

/// Reads the file as a user does; what it says, it says again after it was written with other
/// positions. Errors are `Error`; anything else is a find.
template <class Read, class Write>
void read_and_write(const std::filesystem::path& path, const std::filesystem::path& written,
                    Read read, Write write) {
  formats::MeshFile file;
  try {
    file = read(path);
  } catch (const Error& error) {
    require(std::string(error.what()).starts_with(path.parent_path().string()),
            "an error says which file");
    return;
  }
  check_mesh(file);
  ask_for_names(file);
  move_nodes(file.mesh);
  write(written, file);
  const formats::MeshFile again = read(written);
  require(again.mesh.node_count() == file.mesh.node_count() &&
              again.mesh.element_count() == file.mesh.element_count(),
          "written and read again it is as large");
  for (std::size_t block = 0; block < file.mesh.blocks.size(); ++block) {
    const ElementBlock& own = file.mesh.blocks[block];
    const auto& nodes = again.mesh.blocks[block].nodes;
    const auto width = element_width(own.type);
    for (std::size_t first = 0; first < own.nodes.size(); first += width) {
      require(has_nodes(own.type, std::span(own.nodes).subspan(first, width),
                        std::span<const NodeId>(nodes).subspan(first, width)),
              "written and read again it has the same elements");
    }
  }
}

/// The same for formats whose library may find, only as it writes, that a file is damaged.
inline void read_and_try_to_write(const std::filesystem::path& path,
                                  const std::filesystem::path& written) {
  try {
    formats::MeshFile file = formats::read_mesh_file(path);
    check_mesh(file);
    ask_for_names(file);
    move_nodes(file.mesh);
    formats::write_mesh_file(written, file);
    check_mesh(formats::read_mesh_file(written));
  } catch (const Error& error) {
    require(std::string(error.what()).starts_with(path.parent_path().string()),
            "an error says which file");
  }
}

}  // namespace meshsmooth::testing

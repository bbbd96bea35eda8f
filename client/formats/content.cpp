#include "content.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <span>

#include "cell_sides.hpp"
#include "cells.hpp"

namespace meshsmooth::formats {
namespace {

int dimension_of(const std::filesystem::path& path, const Dataset& dataset, const Cell& cell,
                 std::int64_t id) {
  if (const auto dimension = cell_dimension(cell.type, cell.nodes.size())) return *dimension;
  std::string name = dataset.cell_name(cell.type);
  if (find_vtk_cell(cell.type) != nullptr || cell.type == kPolygonCell) {
    name += " with " + std::to_string(cell.nodes.size()) + " nodes";
  }
  fail("ELEMENT_NOT_SUPPORTED", path,
       "element " + std::to_string(id) + " is of the type " + name + "; " + kSupportedElements);
}

/// Of a cell that keeps its nodes where they are where the mesh has its dimension; those of own
/// types do so in every mesh.
std::optional<int> held_dimension(const Dataset& dataset, const Cell& cell) {
  if (cell.type >= kFirstOwnCellType) return dataset.own_dimension(cell.type);
  if (cell.type == kPolyhedronCell) return 3;
  if (cell.type == kTriangleStripCell) return 2;
  if (cell.type == kPolygonCell && cell.nodes.size() > 4) return 2;
  return std::nullopt;
}

/// The cells that are not of the mesh's dimension.
class LowerDimensionalCells {
 public:
  explicit LowerDimensionalCells(std::size_t node_count) : used_(node_count, 0) {}
  void add(const Cell& cell) {
    ++count_;
    for (const std::int64_t id : cell.nodes) {
      const auto node = static_cast<std::size_t>(id);
      if (node < used_.size()) used_[node] = 1;
    }
  }
  void store(FileContent& content) const {
    content.lower_dimensional_cell_count = count_;
    for (std::size_t node = 0; node < used_.size(); ++node) {
      if (used_[node] != 0) content.lower_dimensional_nodes.push_back(static_cast<NodeId>(node));
    }
  }

 private:
  std::vector<std::uint8_t> used_;
  std::int64_t count_ = 0;
};

/// One block per type, in the order in which the types come up.
class Blocks {
 public:
  /// Nodes that do not exist are for core's `validate`, as long as they fit a NodeId.
  void add(ElementType type, const Cell& cell, std::int64_t place_of_cell) {
    std::size_t& place = places_[static_cast<std::size_t>(type)];
    if (place == kNowhere) {
      place = blocks_.size();
      blocks_.push_back({type, {}});
      cells_.emplace_back();
    }
    for (const std::int64_t node : cell.nodes) {
      blocks_[place].nodes.push_back(static_cast<NodeId>(node));
    }
    cells_[place].push_back(place_of_cell);
  }
  void store(Mesh& mesh, FileContent& content) {
    mesh.blocks = std::move(blocks_);
    for (const auto& cells : cells_) {
      content.element_cells.insert(content.element_cells.end(), cells.begin(), cells.end());
    }
  }

 private:
  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  std::array<std::size_t, kElementTypeCount> places_ = [] {
    std::array<std::size_t, kElementTypeCount> none{};
    none.fill(kNowhere);
    return none;
  }();
  std::vector<ElementBlock> blocks_;
  std::vector<std::vector<std::int64_t>> cells_;
};

/// Programs disagree on the side from which VTK's wedges of second order are seen, and VTK's
/// documents with its shape functions: where most of a block are inverted, all are turned over.
/// Formats with an order of their own have been so already.
void turn_wedges(Mesh& mesh) {
  std::vector<Vec3d> positions;
  for (ElementBlock& block : mesh.blocks) {
    if (block.type != ElementType::wedge15 && block.type != ElementType::wedge18) continue;
    if (positions.empty()) {
      std::visit(
          [&](const auto& all) {
            for (const auto& position : all) positions.push_back(vec3_cast<double>(position));
          },
          mesh.positions);
    }
    const CellKind& kind = cell_kind(block.type);
    const std::size_t width = element_width(block.type);
    std::int64_t sides = 0;
    for (std::size_t at = 0; at < block.nodes.size(); at += width) {
      sides += side_of<NodeId>(kind, std::span(block.nodes).subspan(at, width), positions);
    }
    for (std::size_t at = 0; sides < 0 && at < block.nodes.size(); at += width) {
      mirror(kind, std::span(block.nodes).subspan(at, width));
    }
  }
}

}  // namespace

void Facets::add(const Cell& cell) {
  const CellKind* const kind = find_vtk_cell(cell.type, cell.nodes.size());
  if (kind == nullptr || kind->dimension == 3) return;
  add(cell.nodes, corner_count(*kind));
}

void check_node_count(const MeshFile& file) {
  const auto& content = file.content();
  if (!content) return;
  const auto expected = static_cast<std::size_t>(content->dataset->node_count());
  if (file.mesh.node_count() != expected) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                      "the mesh has " + std::to_string(file.mesh.node_count()) +
                          " nodes, the file it was read from " + std::to_string(expected));
  }
}

void check_held_cells(const std::filesystem::path& path, const MeshFile& file,
                      std::initializer_list<int> carried) {
  for (const HeldCells& held : file.held_cells()) {
    if (std::ranges::find(carried, held.cell_type) != carried.end()) continue;
    fail("ELEMENT_NOT_SUPPORTED", path,
         "this format cannot carry the " + std::to_string(held.count) + " cells of the type " +
             held.name);
  }
}

MeshFile make_mesh_file(const std::filesystem::path& path, FileContent content) {
  const Dataset& dataset = *content.dataset;
  const std::int64_t node_count = dataset.node_count();
  const std::int64_t cell_count = dataset.cell_count();
  if (node_count == 0) fail("MESH_EMPTY", path, "there are no nodes in it");
  if (node_count > std::numeric_limits<NodeId>::max()) {
    fail("FORMAT_ERROR", path, std::to_string(node_count) + " nodes are more than 2147483647");
  }

  const auto id_of = [&](std::int64_t id) {
    return content.cell_ids.empty() ? id : content.cell_ids[static_cast<std::size_t>(id)];
  };
  const auto check_nodes = [&](const Cell& of, std::int64_t id) {
    for (const std::int64_t node : of.nodes) {
      if (node == static_cast<NodeId>(node)) continue;
      fail("FORMAT_ERROR", path,
           "element " + std::to_string(id_of(id)) + " uses node " + std::to_string(node) +
               ", there are only " + std::to_string(node_count));
    }
  };
  Cell cell;
  std::vector<std::int8_t> dimensions(static_cast<std::size_t>(cell_count));
  for (std::int64_t id = 0; id < cell_count; ++id) {
    dataset.get_cell(id, cell);
    const auto held = held_dimension(dataset, cell);
    const int dimension = held ? *held : dimension_of(path, dataset, cell, id_of(id));
    dimensions[static_cast<std::size_t>(id)] = static_cast<std::int8_t>(dimension);
    check_nodes(cell, id);
  }
  const auto highest = std::max_element(dimensions.begin(), dimensions.end());
  if (highest == dimensions.end() || *highest < 2) {
    std::map<std::string, std::int64_t> own;  // counts by name
    for (std::int64_t id = 0; id < cell_count; ++id) {
      dataset.get_cell(id, cell);
      if (cell.type >= kFirstOwnCellType) ++own[dataset.cell_name(cell.type)];
    }
    std::string only;
    for (const auto& [name, count] : own) {
      only += (only.empty() ? ", only " : ", ") + std::to_string(count) + " of the type " + name;
    }
    fail("MESH_EMPTY", path, "there are no surface or volume elements in it" + only);
  }

  Mesh mesh;
  Blocks blocks;
  LowerDimensionalCells lower_dimensional(static_cast<std::size_t>(node_count));
  std::map<int, std::int64_t> held_counts;  // by type
  const auto hold = [&](const Cell& of) {
    ++held_counts[of.type];
    mesh.fixed.resize(static_cast<std::size_t>(node_count), 0);
    for (const std::int64_t node : of.nodes) {
      if (node >= 0 && node < node_count) mesh.fixed[static_cast<std::size_t>(node)] = 1;
    }
  };
  for (std::int64_t id = 0; id < cell_count; ++id) {
    dataset.get_cell(id, cell);
    const bool own = cell.type >= kFirstOwnCellType;
    if (dimensions[static_cast<std::size_t>(id)] < *highest && !own) {
      lower_dimensional.add(cell);
    } else if (held_dimension(dataset, cell)) {
      hold(cell);
    } else {
      const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
      blocks.add(*kind->element, cell, id);
    }
  }
  auto& pairs = content.node_pairs;
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  if (!content.fixed_nodes.empty()) mesh.fixed.resize(static_cast<std::size_t>(node_count), 0);
  for (const NodeId node : content.fixed_nodes) mesh.fixed[static_cast<std::size_t>(node)] = 1;
  mesh.positions = dataset.positions();
  blocks.store(mesh, content);
  for (const auto& [type, count] : held_counts) {
    content.held_cells.push_back({type, dataset.cell_name(type), count});
  }
  if (content.element_cells.empty()) {
    fail("MESH_EMPTY", path,
         "there are no elements that can be smoothed in it; it has " +
             std::to_string(content.held_cells.front().count) + " cells of the type " +
             content.held_cells.front().name + "; " + kSupportedElements);
  }
  turn_wedges(mesh);
  lower_dimensional.store(content);
  if (!content.node_ids.empty()) {
    auto& order = content.nodes_by_id;
    order.resize(content.node_ids.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](NodeId a, NodeId b) {
      return content.node_ids[static_cast<std::size_t>(a)] <
             content.node_ids[static_cast<std::size_t>(b)];
    });
  }
  return {std::move(mesh), std::make_shared<const FileContent>(std::move(content))};
}

TextSegment whole_file(std::string text, CoordinateFields fields) {
  std::vector<NodeId> nodes(fields.positions.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  return {0, false, std::move(text), std::move(fields), std::move(nodes)};
}

std::string replace_coordinates(const TextSegment& segment, const Mesh& mesh) {
  std::vector<Vec3d> positions = segment.fields.positions;
  const auto move = [](double& from, double to) {
    if (from != to) from = to;
  };
  const auto gather = [&](const auto& all) {
    for (std::size_t index = 0; index < positions.size(); ++index) {
      const auto to = vec3_cast<double>(all[static_cast<std::size_t>(segment.nodes[index])]);
      move(positions[index].x, to.x);
      move(positions[index].y, to.y);
      move(positions[index].z, to.z);
    }
  };
  std::visit(gather, mesh.positions);
  return replace_coordinates(segment.text, segment.fields, std::span<const Vec3d>(positions));
}

std::shared_ptr<const Dataset> dataset_of(const MeshFile& file) {
  if (file.content()) return file.content()->dataset;
  return std::make_shared<PlainDataset>(file.mesh);
}

}  // namespace meshsmooth::formats

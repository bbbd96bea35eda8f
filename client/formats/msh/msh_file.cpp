#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "content.hpp"
#include "msh/groups.hpp"
#include "msh/msh_content.hpp"
#include "msh/tag_index.hpp"
#include "node_orders.hpp"
#include "readers.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

/// A polyhedron lists the nodes of its parts; here each once, in any order.
void keep_first_of_each(std::vector<std::int64_t>& nodes) {
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

/// Adds the elements with Gmsh's order of nodes turned into VTK's.
class CellAdder {
 public:
  CellAdder(const path& file, const MshContent& content, const TagIndex& nodes,
            PlainDataset& dataset)
      : file_(file), content_(content), nodes_(nodes), dataset_(dataset) {}

  void add(const MshElement& element) {
    const auto count = static_cast<std::size_t>(element.node_count);
    cell_.resize(count);
    const MshElementType& type = *element.type;
    if (type.kind == nullptr) {
      for (std::size_t node = 0; node < count; ++node) cell_[node] = node_of(element, node);
      if (type.cell_type == kPolyhedronCell) keep_first_of_each(cell_);
      dataset_.add_cell(
          type.cell_type != 0 ? type.cell_type : dataset_.own_type(type.own_name, type.dimension),
          cell_);
      return;
    }
    if (type.kind != kind_) {
      kind_ = type.kind;
      places_ = places_in(NodeOrder::gmsh, *kind_);
    }
    for (std::size_t node = 0; node < count; ++node) {
      cell_[node] = node_of(element, static_cast<std::size_t>(places_[node]));
    }
    dataset_.add_cell(kind_->vtk_type, cell_);
  }

 private:
  [[nodiscard]] std::int64_t node_of(const MshElement& element, std::size_t place) const {
    const std::int64_t tag = content_.node_tags[element.first + place];
    const auto node = nodes_.find(tag);
    if (!node) {
      fail("FORMAT_ERROR", file_,
           "element " + std::to_string(element.tag) + " uses node " + std::to_string(tag) +
               ", which is not in the file");
    }
    return static_cast<std::int64_t>(*node);
  }

  const path& file_;
  const MshContent& content_;
  const TagIndex& nodes_;
  PlainDataset& dataset_;
  std::vector<std::int64_t> cell_;
  const CellKind* kind_ = nullptr;
  std::span<const std::int8_t> places_;
};

/// A number or several for each node or element; none where the file has none.
void add_view(const MshView& view, const TagIndex& index, std::size_t count,
              PlainDataset& dataset) {
  Table table{view.name, view.components, {}};
  table.values.assign(count * view.components, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 0; row < view.tags.size(); ++row) {
    const auto place = index.find(view.tags[row]);
    if (!place) continue;
    std::copy_n(view.values.begin() + static_cast<std::ptrdiff_t>(row * view.components),
                view.components,
                table.values.begin() + static_cast<std::ptrdiff_t>(*place * view.components));
  }
  if (view.components > 1) {
    view.on_nodes ? dataset.add_node_table(std::move(table))
                  : dataset.add_cell_table(std::move(table));
    return;
  }
  Column column{view.name, false, std::move(table.values)};
  view.on_nodes ? dataset.add_node_column(std::move(column))
                : dataset.add_cell_column(std::move(column));
}

void add_views(const MshContent& file, const TagIndex& nodes,
               const std::vector<std::int64_t>& cell_ids, PlainDataset& dataset) {
  std::optional<TagIndex> elements;  // made where it is needed
  for (const MshView& view : file.views) {
    if (!view.on_nodes && !elements) elements.emplace(cell_ids);
    add_view(view, view.on_nodes ? nodes : *elements,
             view.on_nodes ? file.nodes.node_ids.size() : cell_ids.size(), dataset);
  }
}

}  // namespace

MeshFile read_msh(const path& file) {
  FileContent content;
  content.extension = ".msh";
  content.text = read_bytes(file);
  MshContent read = parse_msh(file, content.text);
  const TagIndex nodes(read.nodes.node_ids);
  if (nodes.repeated()) {
    fail("FORMAT_ERROR", file, "two nodes have the number " + std::to_string(*nodes.repeated()));
  }
  const auto dataset = std::make_shared<PlainDataset>();
  dataset->set_positions(read.nodes.positions);
  CellAdder cells(file, read, nodes, *dataset);
  content.cell_ids.reserve(read.elements.size());
  for (const MshElement& element : read.elements) {
    cells.add(element);
    content.cell_ids.push_back(element.tag);
  }
  content.node_ids = read.nodes.node_ids;
  add_msh_groups(read, *dataset, content);
  add_views(read, nodes, content.cell_ids, *dataset);
  for (const auto& [tag, other_tag] : read.periodic_nodes) {
    const auto node = nodes.find(tag), other = nodes.find(other_tag);
    if (!node && !other) continue;  // of a part of the mesh that is not in the file
    content.node_pairs.push_back(
        {static_cast<NodeId>(node ? *node : *other), static_cast<NodeId>(other ? *other : *node)});
  }
  content.fields = std::move(read.nodes);
  content.dataset = dataset;
  return make_mesh_file(file, std::move(content));
}

CoordinateFields find_msh_coordinates(const path& file, std::string_view text) {
  return parse_msh(file, text).nodes;
}

void write_msh(const path& file, const MeshFile& mesh_file) {
  const FileContent& content = *mesh_file.content();
  write_bytes(file,
              replace_coordinates(content.text, content.fields, mesh_file.mesh.positions_view()));
}

}  // namespace meshsmooth::formats

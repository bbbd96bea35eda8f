#include "xdmf_cells.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

struct Type {
  std::string_view name;  // in lower case
  std::int64_t number;    // in a mixed topology
  int vtk_type;
};

constexpr auto kTypes = std::to_array<Type>({{"polyvertex", 1, kVertexCell},
                                             {"polyline", 2, kLineCell},
                                             {"polygon", 3, kPolygonCell},
                                             {"triangle", 4, kTriangleCell},
                                             {"quadrilateral", 5, kQuadCell},
                                             {"tetrahedron", 6, kTetrahedronCell},
                                             {"pyramid", 7, kPyramidCell},
                                             {"wedge", 8, kWedgeCell},
                                             {"hexahedron", 9, kHexahedronCell},
                                             {"edge_3", 0x22, kEdge3Cell},
                                             {"triangle_6", 0x24, kTriangle6Cell},
                                             {"quadrilateral_8", 0x25, kQuad8Cell},
                                             {"quadrilateral_9", 0x23, kQuad9Cell},
                                             {"tetrahedron_10", 0x26, kTetrahedron10Cell},
                                             {"pyramid_13", 0x27, kPyramid13Cell},
                                             {"wedge_15", 0x28, kWedge15Cell},
                                             {"wedge_18", 0x29, kWedge18Cell},
                                             {"hexahedron_20", 0x30, kHexahedron20Cell},
                                             {"hexahedron_27", 0x32, kHexahedron27Cell},
                                             // as some programs, meshio among them, call them
                                             {"tri_6", 0x24, kTriangle6Cell},
                                             {"quad_8", 0x25, kQuad8Cell},
                                             {"quad_9", 0x23, kQuad9Cell},
                                             {"tet_10", 0x26, kTetrahedron10Cell},
                                             {"hex_20", 0x30, kHexahedron20Cell},
                                             {"hex_27", 0x32, kHexahedron27Cell}});

/// 0: there is none.
template <class Key>
int find_type(const Key& key, Key Type::*field) {
  const auto* known = std::ranges::find(kTypes, key, field);
  return known == kTypes.end() ? 0 : known->vtk_type;
}

const CellKind* kind_of(const std::filesystem::path& path, const std::string& grid, int vtk_type,
                        std::size_t node_count, const std::string& name) {
  if (const CellKind* kind = find_vtk_cell(vtk_type, node_count)) return kind;
  fail("ELEMENT_NOT_SUPPORTED", path,
       "the grid \"" + grid + "\" has elements of the type " + name + "; " + kSupportedElements);
}

std::size_t node_count_of(int vtk_type) {
  const CellKind* const kind = find_vtk_cell(vtk_type);
  return kind == nullptr ? 0 : static_cast<std::size_t>(kind->node_count);
}

std::int64_t whole_attribute(const XdmfData& data, const XmlElement& element, const char* name,
                             std::int64_t otherwise) {
  const std::string text = element.attribute(name);
  if (text.empty()) return otherwise;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) {
    data.fail(std::string("the attribute ") + name + "=\"" + text + "\" of <" + element.name() +
              "> is no count");
  }
  return value;
}

/// A stream of types, each with its nodes; of points, lines and polygons also their number.
void read_mixed(const XdmfData& data, const std::filesystem::path& path, const std::string& grid,
                const std::vector<std::int64_t>& stream, std::int64_t first_node, CellList& cells) {
  std::size_t place = 0;
  while (place < stream.size()) {
    const std::int64_t number = stream[place++];
    const int type = find_type(number, &Type::number);
    std::size_t corners = node_count_of(type);
    if (number >= 1 && number <= 3 && place < stream.size()) {
      corners = static_cast<std::size_t>(stream[place++]);
    }
    const CellKind* const kind =
        kind_of(path, grid, type, corners, "number " + std::to_string(number));
    if (corners > stream.size() - place) {
      data.fail("the topology of the grid \"" + grid + "\" ends within an element");
    }
    cells.add(*kind, NodeOrder::vtk, std::span(stream).subspan(place, corners), first_node);
    place += corners;
  }
}

/// The cell's nodes in ascending order, by which it is found again.
std::vector<std::int64_t> key_of(const Dataset& dataset, std::int64_t id) {
  Cell cell;
  dataset.get_cell(id, cell);
  std::ranges::sort(cell.nodes);
  return std::move(cell.nodes);
}

/// The cells of the mesh, to be found by their nodes.
class CellFinder {
 public:
  explicit CellFinder(const Dataset& dataset) {
    for (std::int64_t id = 0; id < dataset.cell_count(); ++id) {
      cells_.emplace_back(key_of(dataset, id), id);
    }
    std::ranges::sort(cells_);
  }
  /// -1: there is none.
  [[nodiscard]] std::int64_t find(const std::vector<std::int64_t>& key) const {
    const auto found = std::ranges::lower_bound(cells_, key, {}, &Entry::first);
    return found == cells_.end() || found->first != key ? -1 : found->second;
  }

 private:
  using Entry = std::pair<std::vector<std::int64_t>, std::int64_t>;
  std::vector<Entry> cells_;
};

}  // namespace

void read_xdmf_cells(XdmfData& data, const std::filesystem::path& path, const XmlElement& grid,
                     CellList& cells) {
  const XmlElement topology = grid.children("Topology").front();
  const std::string name = grid.attribute("Name");
  std::string type = topology.attribute("TopologyType");
  if (type.empty()) type = topology.attribute("Type");
  std::string lower = type;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char letter) { return std::tolower(letter); });
  const std::int64_t first_node = whole_attribute(data, topology, "BaseOffset", 0);
  const std::size_t before = cells.size();
  const int vtk_type = find_type(std::string_view(lower), &Type::name);
  if (lower == "mixed") {
    read_mixed(data, path, name, data.integers(data.item_of(topology)), first_node, cells);
  } else {
    const auto corners = static_cast<std::size_t>(whole_attribute(
        data, topology, "NodesPerElement", static_cast<std::int64_t>(node_count_of(vtk_type))));
    const CellKind* const kind = kind_of(path, name, vtk_type, corners, "\"" + type + "\"");
    const std::vector<std::int64_t> nodes = data.integers(data.item_of(topology));
    if (nodes.size() % corners != 0) {
      data.fail("the topology of the grid \"" + name + "\" has " + std::to_string(nodes.size()) +
                " numbers, which is no multiple of " + std::to_string(corners));
    }
    for (std::size_t first = 0; first < nodes.size(); first += corners) {
      cells.add(*kind, NodeOrder::vtk, std::span(nodes).subspan(first, corners), first_node);
    }
  }
  const auto count = static_cast<std::int64_t>(cells.size() - before);
  const std::int64_t expected = whole_attribute(data, topology, "NumberOfElements", count);
  if (expected != count) {
    data.fail("the topology of the grid \"" + name + "\" has " + std::to_string(count) +
              " elements, not " + std::to_string(expected));
  }
}

void read_xdmf_tags(XdmfData& data, const std::filesystem::path& path, const XmlElement& grid,
                    FileContent& content, PlainDataset& dataset) {
  CellList list;
  read_xdmf_cells(data, path, grid, list);
  PlainDataset tagged;
  tagged.set_positions(Positions{});
  list.store(tagged);
  for (const XmlElement& attribute : grid.children("Attribute")) {
    const XmlElement item = data.item_of(attribute);
    if (attribute.attribute("Center") != "Cell" || !data.is_whole(item)) continue;
    const std::string name = attribute.attribute("Name");
    const std::vector<std::int64_t> values = data.integers(item);
    if (static_cast<std::int64_t>(values.size()) != tagged.cell_count()) {
      data.fail("the attribute \"" + name + "\" has " + std::to_string(values.size()) +
                " numbers for " + std::to_string(tagged.cell_count()) + " cells");
    }
    const CellFinder mesh(dataset);
    std::map<std::int64_t, NodeSet> sets;
    Column column{name, true, std::vector<double>(static_cast<std::size_t>(dataset.cell_count()))};
    bool tags_cells = false;
    for (std::size_t row = 0; row < values.size(); ++row) {
      const std::vector<std::int64_t> key = key_of(tagged, static_cast<std::int64_t>(row));
      NodeSet& set = sets[values[row]];
      for (const std::int64_t node : key) {
        if (node < 0 || node >= dataset.node_count()) {
          data.fail("the grid \"" + name + "\" uses node " + std::to_string(node) +
                    ", there are only " + std::to_string(dataset.node_count()));
        }
        set.nodes.push_back(static_cast<NodeId>(node));
      }
      const std::int64_t cell = mesh.find(key);
      if (cell < 0) continue;
      column.values[static_cast<std::size_t>(cell)] = static_cast<double>(values[row]);
      tags_cells = true;
    }
    for (auto& [value, set] : sets) {
      set.name = name + ":" + std::to_string(value);
      content.node_sets.push_back(std::move(set));
    }
    if (tags_cells) dataset.add_cell_column(std::move(column));
  }
}

}  // namespace meshsmooth::formats

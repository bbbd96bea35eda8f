#include "xdmf/cells.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>
#include <span>

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

[[noreturn]] void refuse_type(const std::filesystem::path& path, const std::string& grid,
                              const std::string& name) {
  fail("ELEMENT_NOT_SUPPORTED", path,
       "the grid \"" + grid + "\" has elements of the type " + name + "; " + kSupportedElements);
}

/// Cells of which a topology has the numbers of nodes only.
class TopologyReader {
 public:
  TopologyReader(const XdmfData& data, const std::filesystem::path& path,
                 const XdmfTopology& topology, const XdmfNodes& nodes, CellList& cells)
      : data_(data), path_(path), topology_(topology), nodes_(nodes), cells_(cells) {}

  /// A stream of types, each with its nodes; of points, lines and polygons also their number, of
  /// polyhedra that of the faces, each with the number of its nodes.
  void read_mixed() {
    while (place_ < topology_.numbers.size()) {
      const std::int64_t number = take();
      if (number == kPolyhedron) {
        read_polyhedron();
        continue;
      }
      const int type = find_type(number, &Type::number);
      std::size_t corners = node_count_of(type);
      if (number >= 1 && number <= 3) corners = take_count();
      add(type, corners, "number " + std::to_string(number));
    }
  }

  void read_uniform() {
    const int type = find_type(std::string_view(topology_.type), &Type::name);
    const std::size_t corners = topology_.nodes_per_element == 0
                                    ? node_count_of(type)
                                    : static_cast<std::size_t>(topology_.nodes_per_element);
    const std::size_t count = topology_.numbers.size();
    if (corners == 0 || count % corners != 0) {
      if (type == 0 || corners == 0) refuse_type("\"" + topology_.name + "\"");
      data_.fail("the topology of the grid \"" + topology_.grid + "\" has " +
                 std::to_string(count) + " numbers, which is no multiple of " +
                 std::to_string(corners));
    }
    if (count == 0) add_type(type, {}, "\"" + topology_.name + "\"");
    while (place_ < count) add(type, corners, "\"" + topology_.name + "\"");
  }

 private:
  static constexpr std::int64_t kPolyhedron = 16;

  std::int64_t take() {
    if (place_ >= topology_.numbers.size()) refuse_end();
    return topology_.numbers[place_++];
  }
  /// Of what comes next.
  std::size_t take_count() {
    const std::int64_t count = take();
    if (count < 0 || count > static_cast<std::int64_t>(topology_.numbers.size() - place_)) {
      refuse_end();
    }
    return static_cast<std::size_t>(count);
  }

  void read_polyhedron() {
    std::set<std::int64_t> nodes;
    for (std::size_t left = take_count(); left > 0; --left) {
      for (std::size_t corner = take_count(); corner > 0; --corner) nodes.insert(take());
    }
    add_held(kPolyhedronCell, std::vector<std::int64_t>(nodes.begin(), nodes.end()));
  }

  void add(int type, std::size_t corners, const std::string& name) {
    if (corners > topology_.numbers.size() - place_) {
      if (type == 0) refuse_type(name);
      refuse_end();
    }
    const auto nodes = std::span(topology_.numbers).subspan(place_, corners);
    add_type(type, nodes, name);
    place_ += corners;
  }

  void add_type(int type, std::span<const std::int64_t> nodes, const std::string& name) {
    if (nodes.empty()) {
      if (type == 0) refuse_type(name);
      return;
    }
    if (const CellKind* kind = find_vtk_cell(type, nodes.size())) {
      check(nodes);
      cells_.add(*kind, NodeOrder::vtk, nodes, topology_.first_node - nodes_.first);
    } else if (type == kPolygonCell && nodes.size() > 2) {
      add_held(type, nodes);
    } else if (type == kVertexCell) {
      add_held(kPolyVertexCell, nodes);
    } else if (type == kLineCell && nodes.size() > 2) {
      add_held(kPolyLineCell, nodes);
    } else {
      refuse_type(name);
    }
  }

  void add_held(int type, std::span<const std::int64_t> nodes) {
    check(nodes);
    cells_.add(type, nodes, topology_.first_node - nodes_.first);
  }

  void check(std::span<const std::int64_t> nodes) const {
    for (const std::int64_t node : nodes) {
      if (node >= topology_.first_node && node - topology_.first_node < nodes_.count) continue;
      data_.fail("the grid \"" + topology_.grid + "\" uses node " + std::to_string(node) +
                 ", there are only " + std::to_string(nodes_.count));
    }
  }

  [[noreturn]] void refuse_end() const {
    data_.fail("the topology of the grid \"" + topology_.grid + "\" ends within an element");
  }
  [[noreturn]] void refuse_type(const std::string& name) const {
    formats::refuse_type(path_, topology_.grid, name);
  }

  const XdmfData& data_;
  const std::filesystem::path& path_;
  const XdmfTopology& topology_;
  const XdmfNodes& nodes_;
  CellList& cells_;
  std::size_t place_ = 0;
};

}  // namespace

XdmfTopology read_xdmf_topology(XdmfData& data, const std::filesystem::path& path,
                                const XmlElement& topology, const std::string& grid) {
  XdmfTopology result;
  result.grid = grid;
  result.name = topology.attribute("TopologyType");
  if (result.name.empty()) result.name = topology.attribute("Type");
  result.type = result.name;
  std::ranges::transform(result.type, result.type.begin(),
                         [](unsigned char letter) { return std::tolower(letter); });
  if (result.type != "mixed" && find_type(std::string_view(result.type), &Type::name) == 0) {
    refuse_type(path, grid, "\"" + result.name + "\"");
  }
  result.nodes_per_element = whole_attribute(data, topology, "NodesPerElement", 0);
  result.first_node = whole_attribute(data, topology, "BaseOffset", 0);
  result.expected = whole_attribute(data, topology, "NumberOfElements", -1);
  if (result.expected < 0 && topology.attribute("Dimensions").find(' ') == std::string::npos) {
    result.expected = whole_attribute(data, topology, "Dimensions", -1);
  }
  const XmlElement item = data.item_of(topology);
  result.numbers = data.integers(item);
  data.check_size(item, result.numbers.size());
  return result;
}

void read_xdmf_cells(const XdmfData& data, const std::filesystem::path& path,
                     const XdmfTopology& topology, const XdmfNodes& nodes, CellList& cells) {
  const std::size_t before = cells.size();
  TopologyReader reader(data, path, topology, nodes, cells);
  if (topology.type == "mixed") {
    reader.read_mixed();
  } else {
    reader.read_uniform();
  }
  const auto count = static_cast<std::int64_t>(cells.size() - before);
  if (topology.expected >= 0 && topology.expected != count) {
    data.fail("the topology of the grid \"" + topology.grid + "\" has " + std::to_string(count) +
              " elements, not " + std::to_string(topology.expected));
  }
}

}  // namespace meshsmooth::formats

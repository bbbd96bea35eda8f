#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <utility>

#include "cell_list.hpp"
#include "content.hpp"
#include "hdf5_file.hpp"
#include "readers.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

// A node of CGNS is a group of HDF5 with the attribute "label", its type, and the dataset " data".

/// By the number of CGNS's ElementType_t.
constexpr auto kTypes = std::to_array<std::pair<std::int64_t, int>>({{2, kVertexCell},
                                                                     {3, kLineCell},
                                                                     {4, kEdge3Cell},
                                                                     {5, kTriangleCell},
                                                                     {6, kTriangle6Cell},
                                                                     {7, kQuadCell},
                                                                     {8, kQuad8Cell},
                                                                     {9, kQuad9Cell},
                                                                     {10, kTetrahedronCell},
                                                                     {11, kTetrahedron10Cell},
                                                                     {12, kPyramidCell},
                                                                     {14, kWedgeCell},
                                                                     {15, kWedge15Cell},
                                                                     {16, kWedge18Cell},
                                                                     {17, kHexahedronCell},
                                                                     {18, kHexahedron20Cell},
                                                                     {19, kHexahedron27Cell},
                                                                     {21, kPyramid13Cell}});
constexpr std::int64_t kMixed = 20;

const CellKind* find_kind(std::int64_t type) {
  const auto* known = std::ranges::find(kTypes, type, &std::pair<std::int64_t, int>::first);
  return known == kTypes.end() ? nullptr : find_vtk_cell(known->second);
}

const CellKind& kind_of(const path& path, const std::string& section, std::int64_t type) {
  if (const CellKind* kind = find_kind(type)) return *kind;
  const std::string name = type == 22   ? "polygons (NGON_n)"
                           : type == 23 ? "polyhedra (NFACE_n)"
                                        : "elements of CGNS's type " + std::to_string(type);
  fail("ELEMENT_NOT_SUPPORTED", path,
       "section \"" + section + "\" has " + name + "; " + kSupportedElements);
}

/// The tree of nodes.
class Tree {
 public:
  Tree(const path& path, const std::string& bytes) : file(path, bytes) {}

  [[nodiscard]] std::vector<std::string> children(const std::string& parent,
                                                  const std::string& label) const {
    std::vector<std::string> names;
    for (const std::string& name : file.children(parent)) {
      const std::string child = parent + "/" + name;
      if (name.starts_with(" ") || !file.has(child)) continue;
      if (file.text_attribute(child, "label") == label) names.push_back(name);
    }
    return names;
  }
  [[nodiscard]] bool has(const std::string& node) const { return file.has(node + "/ data"); }
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& node) const {
    return file.integers(node + "/ data");
  }
  [[nodiscard]] std::string text(const std::string& node) const {
    std::string text = file.text(node + "/ data").c_str();  // up to its NUL
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }
  /// The first and the last.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range(const std::string& node) const {
    const std::vector<std::int64_t> ends = integers(node);
    if (ends.size() != 2 || ends[0] < 1 || ends[1] < ends[0]) {
      file.fail("\"" + node + "\" is no range");
    }
    return {ends[0], ends[1]};
  }

  Hdf5File file;
};

/// The path of the one zone that is not structured.
std::string find_zone(const Tree& tree, const path& path) {
  std::vector<std::string> zones;
  for (const std::string& base : tree.children("/", "CGNSBase_t")) {
    for (const std::string& zone : tree.children("/" + base, "Zone_t")) {
      zones.push_back("/" + base + "/" + zone);
    }
  }
  if (zones.empty()) tree.file.fail("there is no zone in it");
  if (zones.size() > 1) {
    std::string list;
    for (const std::string& zone : zones) list += (list.empty() ? "" : ", ") + zone;
    tree.file.fail("only a file with one zone can be smoothed; this one has " +
                   std::to_string(zones.size()) + ": " + list);
  }
  const std::string& zone = zones.front();
  if (!tree.has(zone + "/ZoneType") || tree.text(zone + "/ZoneType") != "Unstructured") {
    fail("ELEMENT_NOT_SUPPORTED", path,
         "the zone \"" + zone + "\" is structured; only unstructured ones can be smoothed");
  }
  return zone;
}

void read_nodes(const Tree& tree, const path& path, const std::string& zone, FileContent& content,
                PlainDataset& dataset) {
  CoordinateArrays& arrays = content.arrays;
  std::vector<std::vector<double>> numbers;
  arrays.single_precision = true;
  for (const char* axis : {"X", "Y", "Z"}) {
    const std::string node = zone + "/GridCoordinates/Coordinate" + axis;
    if (!tree.file.has(node)) break;
    const std::string& name = arrays.names.emplace_back(node + "/ data");
    numbers.push_back(tree.file.reals(name));
    arrays.single_precision = arrays.single_precision && tree.file.is_single_precision(name);
  }
  arrays.dimension = arrays.names.size();
  if (arrays.names.empty()) {
    tree.file.fail("\"" + zone + "/GridCoordinates\" has no CoordinateX, CoordinateY …");
  }
  dataset.set_positions(positions_of(path, arrays, numbers));
  const std::vector<std::int64_t> sizes = tree.integers(zone);
  if (sizes.empty() || sizes.front() != dataset.node_count()) {
    tree.file.fail("\"" + zone + "\" has not as many nodes as coordinates");
  }
  for (std::int64_t id = 1; id <= dataset.node_count(); ++id) content.node_ids.push_back(id);
}

/// Some of the elements, which are numbered through all sections.
struct Section {
  std::string name;
  std::string node;
  std::int64_t type;
  std::int64_t first;
  std::int64_t last;
};

std::vector<Section> find_sections(const Tree& tree, const std::string& zone) {
  std::vector<Section> sections;
  for (const std::string& name : tree.children(zone, "Elements_t")) {
    const std::string node = zone + "/" + name;
    const std::vector<std::int64_t> type = tree.integers(node);
    if (type.empty()) tree.file.fail("section \"" + name + "\" has no type");
    const auto [first, last] = tree.range(node + "/ElementRange");
    sections.push_back({name, node, type.front(), first, last});
  }
  std::ranges::sort(sections, {}, &Section::first);
  for (std::size_t place = 1; place < sections.size(); ++place) {
    if (sections[place].first > sections[place - 1].last) continue;
    tree.file.fail("sections \"" + sections[place - 1].name + "\" and \"" + sections[place].name +
                   "\" have elements of the same numbers");
  }
  return sections;
}

class SectionReader {
 public:
  SectionReader(const Tree& tree, const path& path) : tree_(tree), path_(path) {}

  void read(const Section& section, FileContent& content) {
    ++number_;
    std::array<bool, 4> dimensions{};
    const std::vector<std::int64_t> stream = tree_.integers(section.node + "/ElementConnectivity");
    std::int64_t id = section.first;
    std::size_t place = 0;
    while (place < stream.size() && id <= section.last) {
      const std::int64_t type = section.type == kMixed ? stream[place++] : section.type;
      const CellKind& kind = kind_of(path_, section.name, type);
      const auto corners = static_cast<std::size_t>(kind.node_count);
      if (corners > stream.size() - place) break;
      cells_.add(kind, NodeOrder::cgns, std::span(stream).subspan(place, corners), 1);
      column_.values.push_back(number_);
      dimensions[static_cast<std::size_t>(kind.dimension)] = true;
      content.cell_ids.push_back(id++);
      place += corners;
    }
    if (place != stream.size() || id <= section.last) {
      tree_.file.fail("\"" + section.node + "\" has not the nodes of elements " +
                      std::to_string(section.first) + " to " + std::to_string(section.last));
    }
    for (int dimension = 0; dimension < 4; ++dimension) {
      if (!dimensions[static_cast<std::size_t>(dimension)]) continue;
      content.groups.push_back({dimension, section.name, kSectionArray, {number_}});
    }
  }
  void store(PlainDataset& dataset) {
    cells_.store(dataset);
    dataset.add_cell_column(std::move(column_));
  }

 private:
  const Tree& tree_;
  const path& path_;
  CellList cells_;
  Column column_ = {kSectionArray, true, {}};
  int number_ = 0;
};

/// Nodes or elements that a boundary condition names.
std::vector<std::int64_t> read_list(const Tree& tree, const std::string& list,
                                    const std::string& range) {
  if (tree.has(list)) return tree.integers(list);
  std::vector<std::int64_t> all;
  const auto [first, last] = tree.range(range);
  constexpr std::int64_t kMost = std::numeric_limits<NodeId>::max();
  if (last > kMost) tree.file.fail("\"" + range + "\" is no range");
  for (std::int64_t id = first; id <= last; ++id) all.push_back(id);
  return all;
}

/// Boundary conditions as sets of nodes, by their own names and by their families'.
class ConditionReader {
 public:
  ConditionReader(const Tree& tree, FileContent& content, const PlainDataset& dataset)
      : tree_(tree), content_(content), dataset_(dataset) {}

  void read(const std::string& zone) {
    base_ = zone.substr(0, zone.rfind('/'));
    for (const std::string& list : tree_.children(zone, "ZoneBC_t")) {
      for (const std::string& name : tree_.children(zone + "/" + list, "BC_t")) {
        read_condition(zone + "/" + list + "/" + name, name);
      }
    }
  }

 private:
  void read_condition(const std::string& node, const std::string& name) {
    std::vector<NodeId> nodes;
    const bool points = tree_.has(node + "/PointList") || tree_.has(node + "/PointRange");
    const bool elements = tree_.has(node + "/ElementList") || tree_.has(node + "/ElementRange");
    if (!points && !elements) return;
    const std::string location =
        tree_.has(node + "/GridLocation") ? tree_.text(node + "/GridLocation") : "Vertex";
    if (points && location == "Vertex") {
      nodes = nodes_of(node, read_list(tree_, node + "/PointList", node + "/PointRange"), 1);
    } else {
      const std::string kind = points ? "/Point" : "/Element";
      nodes =
          nodes_of_elements(node, read_list(tree_, node + kind + "List", node + kind + "Range"));
    }
    std::set<std::string> names = {name};
    for (const std::string& family : tree_.children(node, "FamilyName_t")) {
      add_family(tree_.text(node + "/" + family), names);
    }
    for (const std::string& called : names) content_.node_sets.push_back({called, nodes});
  }
  /// A family may have other names, as Gmsh writes them.
  void add_family(const std::string& family, std::set<std::string>& names) const {
    const std::string node = base_ + "/" + family;
    names.insert(family);
    if (family.empty() || !tree_.file.has(node)) return;
    for (const std::string& name : tree_.children(node, "FamilyName_t")) {
      names.insert(tree_.text(node + "/" + name));
    }
  }
  [[nodiscard]] std::vector<NodeId> nodes_of(const std::string& node,
                                             const std::vector<std::int64_t>& ids,
                                             std::int64_t first_id) const {
    std::vector<NodeId> nodes;
    for (const std::int64_t id : ids) {
      if (id < first_id || id - first_id >= dataset_.node_count()) {
        tree_.file.fail("\"" + node + "\" names node " + std::to_string(id) + ", there are only " +
                        std::to_string(dataset_.node_count()));
      }
      nodes.push_back(static_cast<NodeId>(id - first_id));
    }
    return nodes;
  }
  [[nodiscard]] std::vector<NodeId> nodes_of_elements(const std::string& node,
                                                      const std::vector<std::int64_t>& ids) const {
    std::vector<std::int64_t> nodes;
    Cell cell;
    for (const std::int64_t id : ids) {
      const auto found = std::ranges::lower_bound(content_.cell_ids, id);
      if (found == content_.cell_ids.end() || *found != id) {
        tree_.file.fail("\"" + node + "\" names element " + std::to_string(id) +
                        ", which does not exist");
      }
      dataset_.get_cell(found - content_.cell_ids.begin(), cell);
      nodes.insert(nodes.end(), cell.nodes.begin(), cell.nodes.end());
    }
    return nodes_of(node, nodes, 0);
  }

  const Tree& tree_;
  FileContent& content_;
  const PlainDataset& dataset_;
  std::string base_;
};

}  // namespace

MeshFile read_cgns(const path& path) {
  FileContent content;
  content.extension = ".cgns";
  content.text = read_bytes(path);
  const Tree tree(path, content.text);
  const std::string zone = find_zone(tree, path);
  const auto dataset = std::make_shared<PlainDataset>();
  read_nodes(tree, path, zone, content, *dataset);
  SectionReader sections(tree, path);
  for (const Section& section : find_sections(tree, zone)) sections.read(section, content);
  sections.store(*dataset);
  ConditionReader(tree, content, *dataset).read(zone);
  content.dataset = dataset;
  return make_mesh_file(path, std::move(content));
}

}  // namespace meshsmooth::formats

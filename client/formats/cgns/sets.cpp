#include "cgns/sets.hpp"

#include <algorithm>
#include <limits>
#include <set>

namespace meshsmooth::formats {
namespace {

/// Nodes or elements that a list names, or a range from the first to the last.
std::vector<std::int64_t> read_list(const CgnsTree& tree, const std::string& list,
                                    const std::string& range) {
  if (tree.has_data(list)) return tree.integers(list);
  std::vector<std::int64_t> all;
  const auto [first, last] = tree.range(range);
  constexpr std::int64_t kMost = std::numeric_limits<NodeId>::max();
  if (last > kMost) tree.fail("\"" + range + "\" is no range");
  for (std::int64_t id = first; id <= last; ++id) all.push_back(id);
  return all;
}

/// Turns what a zone names into nodes of the mesh.
class NodeFinder {
 public:
  NodeFinder(const CgnsTree& tree, const CgnsElements& elements, const PlainDataset& dataset,
             const FileContent& content)
      : tree_(tree), elements_(elements), dataset_(dataset), content_(content) {}

  /// By the list or range called `kind` ("Point"), of vertices or elements by "GridLocation". Sides
  /// that are not cells are facets, and so are vertices, for a condition is one of surfaces.
  [[nodiscard]] NodeSet find(const CgnsZone& zone, const std::string& node,
                             const std::string& kind) const {
    const auto ids = read_list(tree_, node + "/" + kind + "List", node + "/" + kind + "Range");
    const std::string location =
        tree_.has_data(node + "/GridLocation") ? tree_.text(node + "/GridLocation") : "Vertex";
    NodeSet set;
    if (kind == "Point" && location == "Vertex") {
      set.nodes = vertices(zone, node, ids);
      set.facets.add(set.nodes, 0);
      return set;
    }
    for (const std::int64_t id : ids) {
      const Cell cell = elements_.find(node, zone, id, content_, dataset_);
      for (const std::int64_t of : cell.nodes) set.nodes.push_back(static_cast<NodeId>(of));
      set.facets.add(cell);
    }
    return set;
  }
  [[nodiscard]] std::vector<NodeId> vertices(const CgnsZone& zone, const std::string& node,
                                             const std::vector<std::int64_t>& ids) const {
    std::vector<NodeId> nodes;
    const std::int64_t count = zone.size.front();
    for (const std::int64_t id : ids) {
      if (id < 1 || id > count) {
        tree_.fail("\"" + node + "\" names node " + std::to_string(id) + ", there are only " +
                   std::to_string(count));
      }
      nodes.push_back(static_cast<NodeId>(id - 1 + zone.first_node));
    }
    return nodes;
  }

 private:
  const CgnsTree& tree_;
  const CgnsElements& elements_;
  const PlainDataset& dataset_;
  const FileContent& content_;
};

bool has_list(const CgnsTree& tree, const std::string& node, const std::string& kind) {
  return tree.has_data(node + "/" + kind + "List") || tree.has_data(node + "/" + kind + "Range");
}

/// A family may have other names, as Gmsh writes them.
void add_family(const CgnsTree& tree, const std::string& base, const std::string& family,
                std::set<std::string>& names) {
  names.insert(family);
  if (family.empty() || !tree.exists(base + "/" + family)) return;
  for (const std::string& name : tree.children(base + "/" + family, "FamilyName_t")) {
    names.insert(tree.text(name));
  }
}

/// The nodes that the other zone calls so, where a connectivity lists them; else none.
std::vector<NodeId> find_donors(const CgnsTree& tree, const std::string& node,
                                const std::vector<CgnsZone>& zones, const CgnsZone& zone,
                                const NodeFinder& finder) {
  const std::string list = node + "/PointListDonor";
  const bool vertices =
      !tree.has_data(node + "/GridLocation") || tree.text(node + "/GridLocation") == "Vertex";
  if (!vertices || !tree.has_data(list) || !tree.has_data(node)) return {};
  const std::string base = zone.node.substr(0, zone.node.rfind('/'));
  const std::string donor = tree.text(node);
  for (const CgnsZone& other : zones) {
    if (other.node != base + "/" + donor && other.node != "/" + donor) continue;
    return finder.vertices(other, node, tree.integers(list));
  }
  return {};
}

/// Of lists of different lengths no node has a partner that is known.
void add_pairs(const std::vector<NodeId>& nodes, const std::vector<NodeId>& donors,
               std::vector<NodePair>& pairs) {
  if (nodes.size() == donors.size()) {
    for (std::size_t i = 0; i < nodes.size(); ++i) pairs.push_back({nodes[i], donors[i]});
    return;
  }
  for (const NodeId node : nodes) pairs.push_back({node, node});
  for (const NodeId donor : donors) pairs.push_back({donor, donor});
}

}  // namespace

void read_cgns_conditions(const CgnsTree& tree, const CgnsZone& zone, const CgnsElements& elements,
                          const PlainDataset& dataset, FileContent& content) {
  const NodeFinder finder(tree, elements, dataset, content);
  const std::string base = zone.node.substr(0, zone.node.rfind('/'));
  for (const std::string& list : tree.children(zone.node, "ZoneBC_t")) {
    for (const std::string& node : tree.children(list, "BC_t")) {
      const bool points = has_list(tree, node, "Point");
      if (!points && !has_list(tree, node, "Element")) continue;
      NodeSet set = finder.find(zone, node, points ? "Point" : "Element");
      std::set<std::string> names = {cgns_name(node)};
      for (const std::string& family : tree.children(node, "FamilyName_t")) {
        add_family(tree, base, tree.text(family), names);
      }
      for (const std::string& called : names) {
        set.name = called;
        content.node_sets.push_back(set);
      }
    }
  }
}

void read_cgns_interfaces(const CgnsTree& tree, const std::vector<CgnsZone>& zones,
                          const CgnsElements& elements, const PlainDataset& dataset,
                          FileContent& content) {
  const NodeFinder finder(tree, elements, dataset, content);
  for (const CgnsZone& zone : zones) {
    for (const std::string& list : tree.children(zone.node, "ZoneGridConnectivity_t")) {
      for (const char* label : {"GridConnectivity_t", "GridConnectivity1to1_t", "OversetHoles_t"}) {
        for (const std::string& node : tree.children(list, label)) {
          if (!has_list(tree, node, "Point")) continue;
          std::vector<NodeId> nodes = finder.find(zone, node, "Point").nodes;
          const std::vector<NodeId> donors = find_donors(tree, node, zones, zone, finder);
          add_pairs(nodes, donors, content.node_pairs);
          nodes.insert(nodes.end(), donors.begin(), donors.end());
          content.node_sets.push_back({cgns_name(node), std::move(nodes)});
        }
      }
    }
  }
}

}  // namespace meshsmooth::formats

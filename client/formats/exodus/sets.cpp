#include "exodus/sets.hpp"

#include <set>
#include <span>
#include <utility>

namespace meshsmooth::formats {
namespace {

std::string numbered(const std::string& name, std::size_t number) {
  return name + std::to_string(number);
}

/// What the variables and dimensions of a kind of sets are called.
struct Kind {
  const char* name;       // of those that have none
  const char* count;      // of the sets
  const char* variable;   // of each
  const char* dimension;  // of each: how many are in it
  const char* ids;
  const char* names;
  const char* status;
};

constexpr Kind kNodeSets = {"nodeset",  "num_node_sets", "node_ns",  "num_nod_ns",
                            "ns_prop1", "ns_names",      "ns_status"};
constexpr Kind kSideSets = {"sideset",  "num_side_sets", "elem_ss",  "num_side_ss",
                            "ss_prop1", "ss_names",      "ss_status"};
constexpr Kind kElementSets = {"elemset",   "num_elem_sets", "elem_els",  "num_ele_els",
                               "els_prop1", "els_names",     "els_status"};

/// What a set names.
struct Members {
  struct Side {
    std::size_t first;  // in `nodes`
    std::size_t node_count;
    std::size_t corner_count;
  };
  std::vector<std::int64_t> nodes;  // from 1
  std::vector<Side> facets = {};
};

class SetReader {
 public:
  SetReader(const NetcdfFile& file, const ExodusMesh& mesh, std::int64_t node_count)
      : file_(file), mesh_(mesh), node_count_(node_count) {}

  /// `members_of` tells the members by the number of the set.
  template <class MembersOf>
  void read(const Kind& kind, FileContent& content, const MembersOf& members_of) const {
    const std::vector<std::string> names = file_.rows(kind.names);
    const ExodusIds ids(file_, kind.ids);
    std::vector<std::int64_t> status;
    if (file_.has(kind.status)) status = file_.integers(kind.status);
    std::set<std::size_t> numbers;
    for (const std::size_t number : file_.numbers_behind(kind.variable)) numbers.insert(number);
    for (const std::size_t number : file_.dimension_numbers(kind.dimension)) {
      numbers.insert(number);
    }
    const std::size_t count = file_.dimension(kind.count).value_or(0);
    for (const std::size_t number : numbers) {
      if (number > count) continue;
      const std::string variable = numbered(kind.variable, number);
      const std::string name = exodus_name(names, number - 1, kind.name, ids[number - 1]);
      if (!file_.has(variable)) {
        const bool empty = (number <= status.size() && status[number - 1] == 0) ||
                           file_.dimension(numbered(kind.dimension, number)).value_or(0) == 0;
        if (empty) continue;
        file_.fail("the set \"" + name + "\" has no variable \"" + variable + "\"");
      }
      content.node_sets.push_back(make_set(name, members_of(variable, number)));
    }
  }

  /// Of sides, the number of the set being that of its variables.
  [[nodiscard]] Members find_sides(const std::string& variable, std::size_t number) const {
    const std::vector<std::int64_t> elements = file_.integers(variable);
    const std::vector<std::int64_t> sides = file_.integers(numbered("side_ss", number));
    if (sides.size() != elements.size()) {
      file_.fail("\"" + variable + "\" has another size than its sides");
    }
    Members members;
    for (std::size_t row = 0; row < sides.size(); ++row) {
      if (add_side(elements[row], sides[row], members)) continue;
      file_.fail("\"" + variable + "\" has side " + std::to_string(sides[row]) + " of element " +
                 std::to_string(elements[row]) + ", which does not exist");
    }
    return members;
  }

  [[nodiscard]] std::vector<std::int64_t> nodes_of_elements(const std::string& variable) const {
    std::vector<std::int64_t> nodes;
    for (const std::int64_t element : file_.integers(variable)) {
      const auto [block, row] = find(element);
      if (block == nullptr) {
        file_.fail("\"" + variable + "\" has element " + std::to_string(element) +
                   ", which does not exist");
      }
      const std::int64_t* first = block->elements.nodes_of(row);
      nodes.insert(nodes.end(), first, first + block->elements.node_count(row));
    }
    return nodes;
  }

 private:
  /// The nodes, which the file counts from 1.
  [[nodiscard]] NodeSet make_set(std::string name, const Members& members) const {
    NodeSet set{std::move(name), {}};
    for (const std::int64_t node : members.nodes) {
      if (node < 1 || node > node_count_) {
        file_.fail("the set \"" + set.name + "\" has node " + std::to_string(node) +
                   ", there are only " + std::to_string(node_count_));
      }
      set.nodes.push_back(static_cast<NodeId>(node - 1));
    }
    for (const auto& [first, node_count, corner_count] : members.facets) {
      set.facets.add(std::span(set.nodes).subspan(first, node_count), corner_count);
    }
    return set;
  }

  /// By its number, from 1, through all blocks; null: it does not exist.
  [[nodiscard]] std::pair<const ExodusBlock*, std::size_t> find(std::int64_t element) const {
    if (element < 1) return {nullptr, 0};
    auto left = static_cast<std::uint64_t>(element - 1);
    for (const ExodusBlock& block : mesh_.blocks) {
      if (left < block.elements.size()) return {&block, left};
      left -= block.elements.size();
    }
    return {nullptr, 0};
  }

  /// False: there is no such side. Polygons have edges, polyhedra faces; of elements that only
  /// Exodus knows, all nodes are taken.
  bool add_side(std::int64_t element, std::int64_t side, Members& members) const {
    const auto [block, row] = find(element);
    if (block == nullptr || side < 1) return false;
    const std::int64_t* own = block->elements.nodes_of(row);
    const std::size_t count = block->elements.node_count(row);
    const auto place = static_cast<std::size_t>(side - 1);
    const std::size_t first = members.nodes.size();
    std::size_t corner_count = 0;  // 0: not a facet
    if (block->shape) {
      const ExodusSide found = find_exodus_side(*block->shape, side);
      for (const int of_side : found.nodes) members.nodes.push_back(own[of_side]);
      if (found.nodes.empty()) return false;
      if (found.facet) corner_count = found.corner_count;
    } else if (block->faces.size() != 0) {
      if (place >= block->faces.node_count(row)) return false;
      const auto face = static_cast<std::size_t>(block->faces.nodes_of(row)[place]);
      const std::int64_t* nodes = mesh_.faces.nodes_of(face);
      corner_count = mesh_.faces.node_count(face);
      members.nodes.insert(members.nodes.end(), nodes, nodes + corner_count);
    } else if (is_exodus_polygon(*block)) {
      if (place >= count) return false;
      members.nodes.push_back(own[place]);
      members.nodes.push_back(own[(place + 1) % count]);
      corner_count = 2;
    } else {
      members.nodes.insert(members.nodes.end(), own, own + count);
    }
    if (corner_count > 0) {
      members.facets.push_back({first, members.nodes.size() - first, corner_count});
    }
    return true;
  }

  const NetcdfFile& file_;
  const ExodusMesh& mesh_;
  std::int64_t node_count_;
};

}  // namespace

void read_exodus_sets(const NetcdfFile& file, const ExodusMesh& mesh, std::int64_t node_count,
                      FileContent& content) {
  const SetReader reader(file, mesh, node_count);
  reader.read(kNodeSets, content, [&](const std::string& variable, std::size_t) {
    return Members{file.integers(variable)};
  });
  reader.read(kSideSets, content, [&](const std::string& variable, std::size_t number) {
    return reader.find_sides(variable, number);
  });
  reader.read(kElementSets, content, [&](const std::string& variable, std::size_t) {
    return Members{reader.nodes_of_elements(variable)};
  });
}

}  // namespace meshsmooth::formats

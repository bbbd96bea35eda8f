#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "model.hpp"
#include "node_orders.hpp"

namespace meshsmooth::formats {
namespace {

template <class Map>
auto* find_in(Map& map, const std::string& name) {
  const auto found = map.find(name);
  return found == map.end() ? nullptr : &found->second;
}

const char* what(AbaqusModel::Kind kind) {
  return kind == AbaqusModel::Kind::nodes ? "node" : "element";
}

bool are_unique(std::vector<std::int64_t> labels) {
  std::ranges::sort(labels);
  return std::ranges::adjacent_find(labels) == labels.end();
}

Column to_column(const char* name, const std::vector<std::int64_t>& values) {
  return {name, true, {values.begin(), values.end()}};
}

}  // namespace

// --- what the names and labels mean --------------------------------------------

std::size_t AbaqusModel::end_of(std::size_t element) const {
  return element + 1 < elements_.size() ? elements_[element + 1].first : corners_.size();
}

void AbaqusModel::resolve_corners(const DeckReader& reader, Notes& notes) {
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    const Element& element = elements_[index];
    const auto& nodes = scopes_[element.scope].nodes;
    for (std::size_t corner = element.first; corner < end_of(index); ++corner) {
      if (corners_[corner] < 0) {
        corners_[corner] = -1 - corners_[corner];
        continue;
      }
      const auto found = nodes.find(corners_[corner]);
      const auto what = [&] {
        return "element " + std::to_string(element.label) + " uses node " +
               std::to_string(corners_[corner]) + ", which is not there";
      };
      if (found != nodes.end()) {
        corners_[corner] = found->second;
      } else if (element.type.vtk_type >= kFirstOwnCellType) {  // of a network: it has no place
        notes.add("no such corner", [&] { return reader.describe(element.place) + ": " + what(); });
        corners_[corner] = kMissing;
      } else {
        reader.fail_at(element.place, what());
      }
    }
  }
}

void AbaqusModel::append_nodes_of(const std::vector<std::int64_t>& elements,
                                  std::vector<std::int64_t>& nodes) const {
  for (const std::int64_t element : elements) {
    const auto index = static_cast<std::size_t>(element);
    for (std::size_t corner = elements_[index].first; corner < end_of(index); ++corner) {
      if (corners_[corner] != kMissing) nodes.push_back(corners_[corner]);
    }
  }
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

std::vector<std::string> AbaqusModel::names_of(ScopeId scope) const {
  std::vector<std::string> names;
  for (const auto& [alias, of] : instance_names_) {
    if (of == scope) names.push_back(alias);
  }
  if (names.empty() && scope != 0) names.push_back(scopes_[scope].name);
  return names;
}

void AbaqusModel::add_labels(const DeckReader& reader, const Entry& entry,
                             std::vector<std::int64_t>& members, Notes& notes) const {
  const Scope& scope = scopes_[entry.scope];
  const auto& labels = entry.kind == Kind::nodes ? scope.nodes : scope.elements;
  const auto& [first, last, step] = entry.range;
  if (!entry.generated) {
    const auto found = labels.find(first);
    if (found != labels.end()) {
      members.push_back(found->second);
      return;
    }
    notes.add("no such label", [&, label = first] {
      return reader.describe(entry.place) + ": there is no " + what(entry.kind) + " " +
             std::to_string(label) + " for this set";
    });
  } else if (static_cast<std::uint64_t>(last - first) / static_cast<std::uint64_t>(step) >
             labels.size()) {
    std::vector<std::int64_t> found;
    for (const auto& [label, index] : labels) {
      if (label >= first && label <= last && (label - first) % step == 0) found.push_back(index);
    }
    std::ranges::sort(found);
    members.insert(members.end(), found.begin(), found.end());
  } else {
    for (std::int64_t label = first; label <= last; label += step) {
      const auto found = labels.find(label);
      if (found != labels.end()) members.push_back(found->second);
      if (last - label < step) break;  // the next may be no number
    }
  }
}

void AbaqusModel::resolve(const DeckReader& reader, Kind kind, const Entry& entry,
                          std::vector<std::int64_t>& members, Notes& notes) {
  std::vector<std::int64_t> found;
  if (entry.name.empty()) {
    add_labels(reader, entry, found, notes);
  } else {
    found = resolved(reader, entry.scope, entry.kind, entry.name, entry.place, notes).members;
  }
  if (kind != entry.kind) {
    std::vector<std::int64_t> nodes;
    append_nodes_of(found, nodes);
    found = std::move(nodes);
  }
  members.insert(members.end(), found.begin(), found.end());
}

AbaqusModel::Set& AbaqusModel::resolved(const DeckReader& reader, ScopeId scope, Kind kind,
                                        const std::string& name, DeckPlace place, Notes& notes) {
  Set* found = find_in(sets(scope, kind), in_capitals(name));
  if (found == nullptr || found->resolving) {
    reader.fail_at(place, std::string(found == nullptr ? "there is no" : "in itself is the") +
                              " set of " + what(kind) + "s \"" + name + "\"");
  }
  if (found->entries.empty()) return *found;
  constexpr int kMostNested = 1000;
  if (++nested_ > kMostNested) reader.fail_at(place, "expected fewer sets in sets");
  found->resolving = true;
  for (const Entry& entry : std::exchange(found->entries, {})) {
    resolve(reader, kind, entry, found->members, notes);
  }
  found->resolving = false;
  --nested_;
  auto& members = found->members;
  std::ranges::sort(members);
  members.erase(std::unique(members.begin(), members.end()), members.end());
  return *found;
}

// --- the content ---------------------------------------------------------------

void AbaqusModel::store_cells(FileContent& content, PlainDataset& dataset) const {
  std::vector<std::int64_t> nodes;
  for (const std::string& name : held_types_)
    (void)dataset.own_type(name);  // as `held_type` has it
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    const Element& element = elements_[index];
    int type = element.type.vtk_type;
    const std::span own(corners_.data() + element.first, corners_.data() + end_of(index));
    nodes.assign(own.begin(), own.end());
    if (type >= kFirstOwnCellType) std::erase(nodes, kMissing);
    if (const CellKind* const kind = find_vtk_cell(type, own.size())) {
      const auto places = places_in(NodeOrder::abaqus, *kind);
      std::ranges::transform(places, nodes.begin(), [&](std::int8_t place) {
        return own[static_cast<std::size_t>(place)];
      });
    }
    if (type == kPolyVertexCell && nodes.size() == 1) type = kVertexCell;
    if (type == kPolyVertexCell && nodes.size() == 2) type = kLineCell;
    dataset.add_cell(type, nodes);
  }
  std::vector<std::int64_t> labels;
  labels.reserve(elements_.size());
  for (const Element& element : elements_) labels.push_back(element.label);
  if (are_unique(node_labels_)) {
    dataset.add_node_column(to_column(kNodeIdArray, node_labels_));
    content.node_ids = node_labels_;
  }
  if (are_unique(labels)) {
    dataset.add_cell_column(to_column(kElementIdArray, labels));
    content.cell_ids = std::move(labels);
  }
}

void AbaqusModel::store_sets(const DeckReader& reader, const PlainDataset& dataset,
                             FileContent& content, Notes& notes) {
  int dimension = 0;
  for (const Element& element : elements_) {
    const CellKind* const kind = find_vtk_cell(element.type.vtk_type);
    if (kind != nullptr) dimension = std::max(dimension, kind->dimension);
  }
  Cell cell;
  for (ScopeId scope = 0; scope < scopes_.size(); ++scope) {
    const std::vector<std::string> aliases = names_of(scope);
    for (const Kind kind : {Kind::nodes, Kind::elements}) {
      for (auto& [key, set] : sets(scope, kind)) {
        const Set& known = resolved(reader, scope, kind, set.name, {}, notes);
        std::vector<std::int64_t> members = known.members;
        NodeSet named{known.name, {}};
        if (kind == Kind::elements) {
          for (const std::int64_t element : members) {
            dataset.get_cell(element, cell);
            if (cell_dimension(cell.type, cell.nodes.size()) < dimension) named.facets.add(cell);
          }
          std::vector<std::int64_t> nodes;
          append_nodes_of(members, nodes);
          members = std::move(nodes);
        }
        named.nodes.assign(members.begin(), members.end());
        for (const std::string& alias : aliases) {
          content.node_sets.push_back({alias + "." + known.name, named.nodes, named.facets});
        }
        content.node_sets.push_back(std::move(named));
      }
    }
  }
}

void AbaqusModel::store_equations(const DeckReader& reader, FileContent& content, Notes& notes) {
  std::vector<bool> in_element(node_labels_.size(), false);
  for (const std::int64_t corner : corners_) {
    if (corner != kMissing) in_element[static_cast<std::size_t>(corner)] = true;
  }
  for (const std::vector<Entry>& terms : equations_) {
    std::vector<std::vector<std::int64_t>> members(terms.size());
    std::size_t count = 0;
    for (std::size_t term = 0; term < terms.size(); ++term) {
      resolve(reader, Kind::nodes, terms[term], members[term], notes);
      count = std::max(count, members[term].size());
    }
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<NodeId> nodes;
      for (const auto& of_term : members) {
        if (of_term.empty() || (i >= of_term.size() && of_term.size() > 1)) continue;
        const auto node = static_cast<std::size_t>(of_term[of_term.size() == 1 ? 0 : i]);
        if (!in_element[node]) continue;  // a control node, which belongs to no mesh
        nodes.push_back(static_cast<NodeId>(node));
      }
      if (nodes.size() == 1) nodes.push_back(nodes.front());
      for (std::size_t n = 1; n < nodes.size(); ++n) {
        content.node_pairs.push_back({nodes[n - 1], nodes[n]});
      }
    }
  }
}

void AbaqusModel::store_materials(const DeckReader& reader, PlainDataset& dataset, Notes& notes) {
  if (materials_.empty()) return;
  Column column{kMaterialArray, true, std::vector<double>(elements_.size(), 0)};
  for (ScopeId scope = 0; scope < scopes_.size(); ++scope) {
    for (const Section& section : scopes_[scope].sections) {
      if (find_in(scopes_[scope].element_sets, in_capitals(section.element_set)) == nullptr) {
        notes.add("no such section", [&] {
          return reader.describe(section.place) + ": there is no set of elements \"" +
                 section.element_set + "\" for this section";
        });
        continue;
      }
      const Set& set =
          resolved(reader, scope, Kind::elements, section.element_set, section.place, notes);
      for (const std::int64_t element : set.members) {
        column.values[static_cast<std::size_t>(element)] = section.material;
      }
    }
  }
  dataset.add_cell_column(std::move(column));
}

std::shared_ptr<PlainDataset> AbaqusModel::store(const DeckReader& reader, FileContent& content,
                                                 Notes& notes) {
  const auto dataset = std::make_shared<PlainDataset>();
  resolve_corners(reader, notes);
  store_cells(content, *dataset);
  store_sets(reader, *dataset, content, notes);
  store_surfaces(reader, content, notes);
  store_equations(reader, content, notes);
  store_materials(reader, *dataset, notes);
  return dataset;
}

}  // namespace meshsmooth::formats

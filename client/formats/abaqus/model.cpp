#include "model.hpp"

#include <algorithm>
#include <utility>

namespace meshsmooth::formats {
namespace {

template <class Map>
auto* find_in(Map& map, const std::string& name) {
  const auto found = map.find(name);
  return found == map.end() ? nullptr : &found->second;
}

}  // namespace

AbaqusModel::ScopeId AbaqusModel::add_scope(const std::string& name) {
  scopes_.emplace_back().name = name;
  parts_.emplace(in_capitals(name), scopes_.size() - 1);
  return scopes_.size() - 1;
}

const AbaqusModel::ScopeId* AbaqusModel::find_part(const std::string& name) const {
  return find_in(parts_, in_capitals(name));
}

void AbaqusModel::add_instance(const std::string& name, ScopeId scope) {
  instances_[in_capitals(name)] = scope;
  instance_names_.emplace_back(name, scope);
}

const AbaqusModel::ScopeId* AbaqusModel::find_instance(std::string_view name) const {
  return find_in(instances_, in_capitals(name));
}

NodeId AbaqusModel::add_node(ScopeId scope, std::int64_t label, const std::string& set_name) {
  const auto [known, is_new] = scopes_[scope].nodes.emplace(label, node_count());
  if (is_new) node_labels_.push_back(label);
  if (!set_name.empty()) set(scope, Kind::nodes, set_name).members.push_back(known->second);
  return static_cast<NodeId>(known->second);
}

std::optional<std::int64_t> AbaqusModel::find_corner(ScopeId scope, std::int64_t label) const {
  const auto found = scopes_[scope].nodes.find(label);
  if (found == scopes_[scope].nodes.end()) return std::nullopt;
  return -1 - found->second;
}

int AbaqusModel::held_type(const std::string& name) {
  const auto known = std::ranges::find(held_types_, name);
  const auto place = static_cast<int>(known - held_types_.begin());
  if (known == held_types_.end()) held_types_.push_back(name);
  return kFirstOwnCellType + place;
}

const DeckPlace* AbaqusModel::add_element(ScopeId scope, std::int64_t label,
                                          const AbaqusElement& type,
                                          const std::vector<std::int64_t>& nodes,
                                          const std::string& set_name, DeckPlace place) {
  const auto element = static_cast<std::int64_t>(elements_.size());
  const auto [known, is_new] = scopes_[scope].elements.emplace(label, element);
  if (!is_new) return &elements_[static_cast<std::size_t>(known->second)].place;
  elements_.push_back({scope, label, type, corners_.size(), place});
  corners_.insert(corners_.end(), nodes.begin(), nodes.end());
  if (!set_name.empty()) set(scope, Kind::elements, set_name).members.push_back(element);
  return nullptr;
}

AbaqusModel::Sets& AbaqusModel::sets(ScopeId scope, Kind kind) {
  return kind == Kind::nodes ? scopes_[scope].node_sets : scopes_[scope].element_sets;
}

AbaqusModel::Set& AbaqusModel::set(ScopeId scope, Kind kind, const std::string& name) {
  Set& found = sets(scope, kind)[in_capitals(name)];
  if (found.name.empty()) found.name = name;
  return found;
}

void AbaqusModel::add_set(ScopeId scope, Kind kind, const std::string& name) {
  (void)set(scope, kind, name);
}

void AbaqusModel::add_to_set(ScopeId scope, Kind kind, const std::string& name, Entry entry) {
  Set& to = set(scope, kind, name);
  if (kind == entry.kind && entry.name.empty() && !entry.generated) {  // most need no more memory
    const Scope& from = scopes_[entry.scope];
    const auto& labels = kind == Kind::nodes ? from.nodes : from.elements;
    if (const auto found = labels.find(entry.range.first); found != labels.end()) {
      to.members.push_back(found->second);
      return;
    }
  }
  to.entries.push_back(std::move(entry));
}

void AbaqusModel::add_section(ScopeId scope, const std::string& element_set,
                              const std::string& material, DeckPlace place) {
  const auto next = static_cast<std::int32_t>(materials_.size() + 1);
  const std::int32_t number = materials_.emplace(in_capitals(material), next).first->second;
  scopes_[scope].sections.push_back({element_set, number, place});
}

}  // namespace meshsmooth::formats

#include "msh/groups.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace meshsmooth::formats {
namespace {

/// The groups of each element. Before version 3 an element has one of its own; since then it is in
/// those of its entity.
class GroupFinder {
 public:
  explicit GroupFinder(const MshContent& file) : file_(file) {}

  [[nodiscard]] bool by_entity() const { return file_.format.has_entities(); }

  struct Groups {
    std::vector<int> tags;
    std::int32_t set = 0;  // see `FileContent::group_sets`
  };

  const Groups& of(const MshElement& element) {
    const MshEntity key = {element.dimension, by_entity() ? element.entity : element.physical};
    if (last_ != nullptr && key == last_key_) return *last_;  // elements come entity by entity
    auto found = known_.find(key);
    if (found == known_.end()) found = known_.emplace(key, make(key)).first;
    last_key_ = key;
    last_ = &found->second;
    return *last_;
  }

 private:
  Groups make(const MshEntity& key) {
    Groups groups;
    if (!by_entity()) {
      if (key.second != 0) groups.tags.push_back(key.second);
    } else if (const auto found = file_.physicals.find(key); found != file_.physicals.end()) {
      groups.tags = found->second;
    }
    std::vector<int> ordered = groups.tags;
    std::ranges::sort(ordered);
    groups.set = sets_.emplace(ordered, static_cast<std::int32_t>(sets_.size())).first->second;
    return groups;
  }

  const MshContent& file_;
  std::map<std::vector<int>, std::int32_t> sets_ = {{{}, 0}};
  std::map<MshEntity, Groups> known_;
  MshEntity last_key_;
  const Groups* last_ = nullptr;
};

/// By group the values that its elements have in the array of entities (version 4) or of groups.
std::map<MshEntity, std::set<int>> find_groups(const MshContent& file) {
  std::map<MshEntity, std::set<int>> groups;
  for (const auto& [entity, tags] : file.physicals) {
    for (const int tag : tags) groups[{entity.first, tag}].insert(entity.second);
  }
  if (file.format.has_entities()) return groups;
  MshEntity last = {-1, 0};
  for (const MshElement& element : file.elements) {
    const MshEntity group = {element.dimension, element.physical};
    if (element.physical == 0 || group == last) continue;
    groups[group].insert(element.physical);
    last = group;
  }
  return groups;
}

std::string name_of(const MshContent& file, const MshEntity& group) {
  auto found = file.physical_names.find(group);
  if (found == file.physical_names.end()) found = file.physical_names.find({-1, group.second});
  return found == file.physical_names.end() ? "" : found->second;
}

template <class Get>
Column column_of(const char* name, const std::vector<MshElement>& elements, Get get) {
  Column column{name, true, {}};
  column.values.reserve(elements.size());
  for (const MshElement& element : elements) {
    column.values.push_back(static_cast<double>(get(element)));
  }
  return column;
}

}  // namespace

void add_msh_groups(const MshContent& file, PlainDataset& dataset, FileContent& content) {
  dataset.add_cell_column(
      column_of(kEntityArray, file.elements, [](const auto& element) { return element.entity; }));
  dataset.add_cell_column(
      column_of(kElementIdArray, file.elements, [](const auto& element) { return element.tag; }));
  dataset.add_node_column({kNodeIdArray, true, {content.node_ids.begin(), content.node_ids.end()}});
  const auto groups = find_groups(file);
  if (groups.empty()) return;
  GroupFinder finder(file);
  content.group_sets.reserve(file.elements.size());
  dataset.add_cell_column(column_of(kPhysicalArray, file.elements, [&](const auto& element) {
    const GroupFinder::Groups& own = finder.of(element);
    content.group_sets.push_back(own.set);
    return own.tags.empty() ? 0 : own.tags.front();
  }));
  for (const auto& [group, values] : groups) {
    const auto& [dimension, tag] = group;
    const PhysicalName& name =
        content.physical_names.emplace_back(PhysicalName{dimension, tag, name_of(file, group)});
    content.groups.push_back({dimension,
                              name.called(),
                              finder.by_entity() ? kEntityArray : kPhysicalArray,
                              {values.begin(), values.end()}});
  }
}

}  // namespace meshsmooth::formats

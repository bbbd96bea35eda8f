#include "unv/model.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "cells.hpp"
#include "node_orders.hpp"
#include "unv/elements.hpp"

namespace meshsmooth::formats::unv {
namespace {

constexpr std::int64_t kMaxNodesOfElement = 10'000;  // more is not an element
constexpr std::int64_t kNodeEntity = 7;
constexpr std::int64_t kElementEntity = 8;

/// Where the heads of elements have what is needed.
struct ElementLayout {
  std::size_t field_count;
  std::size_t descriptor;
  std::size_t property;
};

ElementLayout layout_of(int data_set) {
  if (data_set == 71) return {7, 2, 3};
  if (data_set == 780) return {8, 1, 3};
  return {6, 1, 2};
}

/// The later ones give four numbers for each entity, the earlier ones two.
std::size_t numbers_per_entity(int data_set) {
  return data_set == 2435 || data_set == 2452 || data_set == 2467 || data_set == 2477 ? 4 : 2;
}

/// Of the two or three nodes of a beam, or of its section, which comes before them.
bool is_section(const Lines& lines, std::size_t node_count) {
  const Integers record = lines.integers();
  if (record.count != node_count) return true;
  const Integers next = lines.integers_of_next_line();
  return record.count == 3 && next.count == 3;
}

Column to_column(const char* name, const std::vector<std::int64_t>& values) {
  return {name, true, {values.begin(), values.end()}};
}

}  // namespace

void Model::read_elements(Lines& lines, int data_set) {
  const ElementLayout layout = layout_of(data_set);
  while (lines.more()) {
    const Integers head = lines.integers();
    if (head.count != layout.field_count || head.last() < 1 || head.last() > kMaxNodesOfElement) {
      lines.scanner().refuse(std::to_string(layout.field_count) +
                                 " numbers, which end with the number of an element's nodes",
                             trimmed(lines.peek()));
    }
    const Element element{head[0], head[layout.descriptor], head[layout.property], corners_.size()};
    const auto count = static_cast<std::size_t>(head.last());
    lines.take();
    lines.require_more("the nodes of element " + std::to_string(element.label));
    if (may_have_section(element.descriptor) && is_section(lines, count)) lines.take();
    read_nodes_of(lines, element, count);
    elements_.push_back(element);
  }
}

void Model::read_nodes_of(Lines& lines, const Element& element, std::size_t count) {
  const std::size_t end = element.first + count;
  while (corners_.size() < end) {
    lines.require_more("the other nodes of element " + std::to_string(element.label) +
                       ", which has " + std::to_string(count));
    const Integers nodes = lines.integers();
    if (corners_.size() + nodes.count > end) {
      lines.scanner().refuse("only the " + std::to_string(count) + " nodes of element " +
                                 std::to_string(element.label),
                             trimmed(lines.peek()));
    }
    for (std::size_t node = 0; node < nodes.count; ++node) corners_.push_back(nodes[node]);
    lines.take();
  }
}

void Model::read_groups(Lines& lines, int data_set) {
  const std::size_t width = numbers_per_entity(data_set);
  while (lines.more()) {
    const Integers head = lines.integers();
    if (head.count < 2 || head.last() < 0) {
      lines.scanner().refuse("a group's number and how many entities it has",
                             trimmed(lines.peek()));
    }
    lines.take();
    Group group{std::string(trimmed(lines.take())), {}, {}};
    if (group.name.empty()) group.name = std::to_string(head[0]);
    std::int64_t left = head.last();
    while (left > 0) {
      lines.require_more(std::to_string(left) + " more entities of group " + group.name);
      const Integers entities = lines.integers();
      if (entities.count % width != 0) {
        lines.scanner().refuse("entities of " + std::to_string(width) + " numbers each",
                               trimmed(lines.peek()));
      }
      for (std::size_t at = 0; at < entities.count && left > 0; at += width, --left) {
        if (entities[at] == kNodeEntity) group.nodes.push_back(entities[at + 1]);
        if (entities[at] == kElementEntity) group.elements.push_back(entities[at + 1]);
      }
      lines.take();
    }
    groups_.push_back(std::move(group));
  }
}

std::size_t Model::end_of(std::size_t element) const {
  return element + 1 < elements_.size() ? elements_[element + 1].first : corners_.size();
}

Model::Indices Model::index_of(const std::vector<std::int64_t>& labels,
                               const std::string& what) const {
  Indices indices;
  indices.reserve(labels.size());
  for (const std::int64_t label : labels) {
    if (!indices.emplace(label, static_cast<std::int64_t>(indices.size())).second) {
      fail("FORMAT_ERROR", file_,
           "two " + what + " have the number " + std::to_string(label) +
               "; write each part to a file of its own, or number them anew");
    }
  }
  return indices;
}

void Model::store(FileContent& content, PlainDataset& dataset) {
  store_elements(content, dataset);
  store_groups(content, dataset);
}

void Model::store_elements(FileContent& content, PlainDataset& dataset) {
  const Indices nodes = index_of(content.node_ids, "nodes");
  used_.assign(nodes.size(), 0);
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    for (std::size_t corner = elements_[index].first; corner < end_of(index); ++corner) {
      const auto found = nodes.find(corners_[corner]);
      if (found == nodes.end()) {
        fail("FORMAT_ERROR", file_,
             "element " + std::to_string(elements_[index].label) + " uses node " +
                 std::to_string(corners_[corner]) + ", which is not in the file");
      }
      corners_[corner] = found->second;
      used_[static_cast<std::size_t>(found->second)] = 1;
    }
  }
  std::vector<std::int64_t> properties;
  std::vector<std::int64_t> cell;
  for (std::size_t index = 0; index < elements_.size(); ++index) {
    const Element& element = elements_[index];
    const auto own = std::span(corners_).subspan(element.first, end_of(index) - element.first);
    if (const CellKind* kind = find_kind(element.descriptor, own.size())) {
      cell.clear();
      for (const std::int8_t place : places_in(NodeOrder::unv, *kind)) {
        cell.push_back(own[static_cast<std::size_t>(place)]);
      }
      dataset.add_cell(kind->vtk_type, cell);
    } else {
      dataset.add_cell(dataset.own_type("FE descriptor " + std::to_string(element.descriptor) +
                                        " with " + std::to_string(own.size()) + " nodes"),
                       own);
    }
    content.cell_ids.push_back(element.label);
    properties.push_back(element.property);
  }
  dataset.add_cell_column(to_column(kEntityArray, properties));
  dataset.add_cell_column(to_column(kElementIdArray, content.cell_ids));
  dataset.add_node_column(to_column(kNodeIdArray, content.node_ids));
}

void Model::store_groups(FileContent& content, PlainDataset& dataset) const {
  const Indices nodes = index_of(content.node_ids, "nodes");
  const Indices elements = index_of(content.cell_ids, "elements");
  std::vector<std::set<std::int32_t>> groups_of(elements_.size());  // their places, from 1
  std::vector<std::int64_t> first_group(elements_.size(), 0);
  std::int32_t number = 0;
  for (const Group& group : groups_) {
    ++number;
    NodeSet set{group.name, {}};
    for (const std::int64_t label : group.nodes) {
      const auto node = nodes.find(label);
      if (node != nodes.end()) set.nodes.push_back(static_cast<NodeId>(node->second));
    }
    std::set<int> dimensions;
    for (const std::int64_t label : group.elements) {
      const auto found = elements.find(label);
      if (found == elements.end()) continue;
      const auto element = static_cast<std::size_t>(found->second);
      groups_of[element].insert(number);
      if (first_group[element] == 0) first_group[element] = number;
      for (std::size_t corner = elements_[element].first; corner < end_of(element); ++corner) {
        set.nodes.push_back(static_cast<NodeId>(corners_[corner]));
      }
      const CellKind* kind =
          find_kind(elements_[element].descriptor, end_of(element) - elements_[element].first);
      if (kind != nullptr) dimensions.insert(kind->dimension);
    }
    for (const int dimension : dimensions) {
      content.groups.push_back({dimension, group.name, kPhysicalArray, {number}});
      content.physical_names.push_back({dimension, number, group.name});
    }
    content.node_sets.push_back(std::move(set));
  }
  if (content.groups.empty()) return;
  dataset.add_cell_column(to_column(kPhysicalArray, first_group));
  std::map<std::set<std::int32_t>, std::int32_t> sets = {{{}, 0}};
  for (const auto& groups : groups_of) {
    content.group_sets.push_back(
        sets.emplace(groups, static_cast<std::int32_t>(sets.size())).first->second);
  }
}

std::int64_t Model::unused_node_count() const { return std::ranges::count(used_, 0); }

}  // namespace meshsmooth::formats::unv

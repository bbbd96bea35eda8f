#include "unv/writer.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "cells.hpp"
#include "content.hpp"
#include "node_orders.hpp"
#include "node_sets.hpp"
#include "unv/elements.hpp"

namespace meshsmooth::formats::unv {
namespace {

using std::filesystem::path;
using Labels = std::vector<std::int64_t>;

constexpr std::int64_t kMostLabel = 9'999'999'999;  // in ten columns

void append_integers(std::string& text, std::span<const std::int64_t> numbers) {
  std::array<char, 32> digits{};
  std::size_t column = 0;
  for (const std::int64_t number : numbers) {
    if (column == 8) text += '\n';
    column = column % 8 + 1;
    const int length =
        std::snprintf(digits.data(), digits.size(), "%10lld", static_cast<long long>(number));
    text.append(digits.data(), static_cast<std::size_t>(length));
  }
  text += '\n';
}

void append_real(std::string& text, double number) {
  std::array<char, 64> digits{};
  const int length = std::snprintf(digits.data(), digits.size(), "%25.16E", number);
  std::ranges::replace(digits, 'E', 'D');
  text.append(digits.data(), static_cast<std::size_t>(length));
}

/// The numbers of a column if they can be labels (positive, each once), else 1, 2 …
Labels make_labels(const std::optional<Column>& ids, std::int64_t count) {
  Labels labels(static_cast<std::size_t>(count));
  for (std::size_t place = 0; place < labels.size(); ++place) {
    labels[place] = static_cast<std::int64_t>(place) + 1;
  }
  if (!ids) return labels;
  Labels own;
  for (const double id : ids->values) {
    if (!(id >= 1) || id > static_cast<double>(kMostLabel)) return labels;
    own.push_back(static_cast<std::int64_t>(id));
  }
  Labels sorted = own;
  std::ranges::sort(sorted);
  return std::ranges::adjacent_find(sorted) == sorted.end() ? own : labels;
}

/// What the elements' properties are: the first column that tells them apart.
std::optional<Column> find_properties(const Dataset& dataset) {
  for (const char* name : {kEntityArray, kReferenceArray}) {
    auto column = dataset.cell_column(name);
    if (column && std::ranges::any_of(column->values, [](double v) { return v >= 1; })) {
      return column;
    }
  }
  return std::nullopt;
}

class Writer {
 public:
  Writer(const path& file_name, const MeshFile& file)
      : file_name_(file_name),
        file_(file),
        dataset_(dataset_of(file)),
        node_labels_(make_labels(dataset_->node_column(kNodeIdArray), dataset_->node_count())),
        cell_labels_(make_labels(dataset_->cell_column(kElementIdArray), dataset_->cell_count())) {}

  std::string make() {
    append_nodes();
    append_elements();
    append_groups();
    return std::move(text_);
  }

 private:
  void open(const char* data_set) { text_ += std::string("    -1\n") + data_set + '\n'; }
  void close() { text_ += "    -1\n"; }

  void append_nodes() {
    open("  2411");
    const auto append = [&](const auto& positions) {
      for (std::size_t node = 0; node < positions.size(); ++node) {
        append_integers(text_, std::array<std::int64_t, 4>{node_labels_[node], 1, 1, 11});
        const auto position = vec3_cast<double>(positions[node]);
        append_real(text_, position.x);
        append_real(text_, position.y);
        append_real(text_, position.z);
        text_ += '\n';
      }
    };
    std::visit(append, file_.mesh.positions);
    close();
  }

  void append_elements() {
    const std::optional<Column> properties = find_properties(*dataset_);
    open("  2412");
    Cell cell;
    Labels nodes;
    for (std::int64_t id = 0; id < dataset_->cell_count(); ++id) {
      dataset_->get_cell(id, cell);
      const auto index = static_cast<std::size_t>(id);
      if (cell.type == kVertexCell) {
        cell_labels_[index] = 0;  // only its node is written
        continue;
      }
      const CellKind* kind = find_vtk_cell(cell.type, cell.nodes.size());
      const auto descriptor = kind == nullptr ? std::nullopt : descriptor_of(*kind);
      if (!descriptor) {
        fail("ELEMENT_NOT_SUPPORTED", file_name_,
             ".unv files cannot carry a " +
                 (kind == nullptr ? dataset_->cell_name(cell.type) : std::string(kind->name)));
      }
      const double property = properties ? properties->values[index] : 1;
      append_integers(
          text_, std::array<std::int64_t, 6>{
                     cell_labels_[index], *descriptor,
                     property >= 1 && property < 1e9 ? static_cast<std::int64_t>(property) : 1, 1,
                     7, kind->node_count});
      if (kind->dimension == 1) append_integers(text_, std::array<std::int64_t, 3>{0, 1, 1});
      nodes.assign(cell.nodes.size(), 0);
      std::size_t node = 0;
      for (const std::int8_t place : places_in(NodeOrder::unv, *kind)) {
        nodes[static_cast<std::size_t>(place)] =
            node_labels_[static_cast<std::size_t>(cell.nodes[node++])];
      }
      append_integers(text_, nodes);
    }
    close();
  }

  /// Of a physical group, by its name.
  [[nodiscard]] Labels elements_of(const CellGroup& group) const {
    Labels found;
    const auto column = dataset_->cell_column(group.array);
    Cell cell;
    for (std::int64_t id = 0; column && id < dataset_->cell_count(); ++id) {
      const auto index = static_cast<std::size_t>(id);
      if (cell_labels_[index] == 0) continue;
      if (std::ranges::find(group.values, column->values[index]) == group.values.end()) continue;
      dataset_->get_cell(id, cell);
      if (cell_dimension(cell.type, cell.nodes.size()) != group.dimension) continue;
      found.push_back(cell_labels_[index]);
    }
    return found;
  }

  void append_groups() {
    const FileContent* content = file_.content().get();
    if (content == nullptr) return;
    std::vector<std::string> names;
    std::map<std::string, Labels> elements;
    std::map<std::string, Labels> nodes;
    const auto note = [&](const std::string& name) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    };
    for (const CellGroup& group : content->groups) {
      note(group.name);
      const Labels found = elements_of(group);
      auto& all = elements[group.name];
      all.insert(all.end(), found.begin(), found.end());
      if (group.dimension == 0) add_nodes(nodes[group.name], find_node_set(file_, group.name));
    }
    for (const NodeSet& set : content->node_sets) {
      if (elements.contains(set.name)) continue;
      note(set.name);
      add_nodes(nodes[set.name], find_node_set(file_, set.name));
    }
    if (names.empty()) return;
    open("  2467");
    for (std::size_t group = 0; group < names.size(); ++group) {
      append_group(static_cast<std::int64_t>(group) + 1, names[group], nodes[names[group]],
                   elements[names[group]]);
    }
    close();
  }

  void add_nodes(Labels& labels, const std::vector<NodeId>& nodes) const {
    for (const NodeId node : nodes) labels.push_back(node_labels_[static_cast<std::size_t>(node)]);
  }

  void append_group(std::int64_t number, const std::string& name, const Labels& nodes,
                    const Labels& elements) {
    const auto count = static_cast<std::int64_t>(nodes.size() + elements.size());
    append_integers(text_, std::array<std::int64_t, 8>{number, 0, 0, 0, 0, 0, 0, count});
    text_ += name + '\n';
    Labels entities;
    for (const std::int64_t node : nodes) entities.insert(entities.end(), {7, node, 0, 0});
    for (const std::int64_t element : elements) {
      entities.insert(entities.end(), {8, element, 0, 0});
    }
    if (!entities.empty()) append_integers(text_, entities);
  }

  const path& file_name_;
  const MeshFile& file_;
  std::shared_ptr<const Dataset> dataset_;
  Labels node_labels_;
  Labels cell_labels_;  // 0: not written
  std::string text_;
};

}  // namespace

std::string make_text(const path& file_name, const MeshFile& file) {
  return Writer(file_name, file).make();
}

}  // namespace meshsmooth::formats::unv

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <vector>

#include "content.hpp"
#include "unv/lines.hpp"

namespace meshsmooth::formats::unv {

/// Elements and groups of a universal file, whose labels are looked up when all has been read.
class Model {
 public:
  explicit Model(const std::filesystem::path& file) : file_(file) {}

  /// Data sets 71, 780 and 2412.
  void read_elements(Lines& lines, int data_set);
  /// 752, 2417, 2429, 2430, 2432, 2435, 2452, 2467 and 2477.
  void read_groups(Lines& lines, int data_set);

  /// `content` has the nodes' ids. Throws FORMAT_ERROR where elements name nodes that are not there
  /// or labels are used twice; members of groups may be missing.
  void store(FileContent& content, PlainDataset& dataset);
  /// Nodes in no element. After `store`.
  [[nodiscard]] std::int64_t unused_node_count() const;

 private:
  using Indices = std::unordered_map<std::int64_t, std::int64_t>;

  struct Element {
    std::int64_t label;
    std::int64_t descriptor;
    std::int64_t property;
    std::size_t first;  // of its nodes
  };
  struct Group {
    std::string name;
    std::vector<std::int64_t> nodes;     // labels
    std::vector<std::int64_t> elements;  // labels
  };

  void read_nodes_of(Lines& lines, const Element& element, std::size_t count);
  [[nodiscard]] std::size_t end_of(std::size_t element) const;
  [[nodiscard]] Indices index_of(const std::vector<std::int64_t>& labels,
                                 const std::string& what) const;
  void store_elements(FileContent& content, PlainDataset& dataset);
  void store_groups(FileContent& content, PlainDataset& dataset) const;

  const std::filesystem::path& file_;
  std::vector<Element> elements_;
  std::vector<std::int64_t> corners_;  // labels, then indices of nodes
  std::vector<Group> groups_;
  std::vector<std::uint8_t> used_;  // by node
};

}  // namespace meshsmooth::formats::unv

#pragma once

#include <set>
#include <string>
#include <vector>

#include "node_sets.hpp"
#include "regions.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats::test {

/// The nodes of a set, by the file's own numbers.
inline std::vector<std::int64_t> ids_of_set(const MeshFile& file, const std::string& name) {
  std::vector<std::int64_t> ids;
  for (const NodeId node : find_node_set(file, name)) ids.push_back(file.file_node_id(node));
  return ids;
}

/// The nodes that belong together, by the file's own numbers; one where the partner is not known.
inline std::set<std::set<std::int64_t>> pairs_of(const MeshFile& file) {
  std::set<std::set<std::int64_t>> pairs;
  for (const auto& [a, b] : file.node_pairs()) {
    pairs.insert({file.file_node_id(a), file.file_node_id(b)});
  }
  return pairs;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The lines of `b` that are not those of `a`; as many lines are expected.
inline std::vector<std::string> changed_lines(const std::string& a, const std::string& b) {
  const std::vector<std::string> before = lines_of(a);
  const std::vector<std::string> after = lines_of(b);
  EXPECT_EQ(before.size(), after.size());
  std::vector<std::string> changed;
  for (std::size_t line = 0; line < std::min(before.size(), after.size()); ++line) {
    if (before[line] != after[line]) changed.push_back(after[line]);
  }
  return changed;
}

inline std::vector<Vec3d>& positions_of(MeshFile& file) {
  return std::get<std::vector<Vec3d>>(file.mesh.positions);
}

}  // namespace meshsmooth::formats::test

#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "mesh_file.hpp"
#include "support/scratch_folder.hpp"

namespace meshsmooth::formats::test {

inline std::filesystem::path fixture(const std::string& name) {
  return std::filesystem::path(MESHSMOOTH_TEST_FILES) / name;
}

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return std::move(bytes).str();
}

inline void put_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

using Scratch = meshsmooth::testing::ScratchFolder;

/// Runs `action`, which must throw `Error`, and gives its reason and text.
template <class Action>
std::pair<std::string, std::string> error_of(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return {error.reason(), error.what()};
  }
  return {"", "no error"};
}

/// Moves every node by something that needs all digits of a double.
inline void move_nodes(Mesh& mesh) {
  std::visit(
      [](auto& nodes) {
        using Node = typename std::decay_t<decltype(nodes)>::value_type;
        using Real = decltype(Node::x);
        Real step = 1;
        for (Node& node : nodes) {
          step = step * Real(1.0009765625) / Real(1.03);
          node += {Real(1) / 3 * step, Real(1e-7) / 7 * step, -Real(1e3) / 9 * step};
        }
      },
      mesh.positions);
}

/// Moves nodes by something that takes no digit more than they have.
inline void double_positions(Mesh& mesh) {
  std::visit(
      [](auto& nodes) {
        for (auto& node : nodes) node += node;
      },
      mesh.positions);
}

inline void expect_same_connectivity(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t block = 0; block < a.blocks.size(); ++block) {
    EXPECT_EQ(a.blocks[block].type, b.blocks[block].type);
    EXPECT_EQ(a.blocks[block].nodes, b.blocks[block].nodes);
  }
}

}  // namespace meshsmooth::formats::test

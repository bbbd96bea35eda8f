#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "generate/cases.hpp"
#include "generate/hash.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/quality.hpp"
#include "node_sets.hpp"

namespace meshsmooth::formats {

inline const std::vector<Vec3d>& nodes_of(const Mesh& mesh) {
  return std::get<std::vector<Vec3d>>(mesh.positions);
}

inline std::int64_t inverted(const MeshFile& file) {
  return measure_quality(file.mesh).inverted_count;
}

/// The least value of a metric.
inline double least(const MeshFile& file, QualityMetric metric) {
  for (const MetricStats& stats : measure_quality(file.mesh).metrics) {
    if (stats.metric == metric) return stats.min;
  }
  ADD_FAILURE() << "the metric was not measured";
  return 0;
}

inline std::size_t fixed_count(const MeshFile& file) {
  return find_node_set(file, kFixedArray).size();
}

/// The same mesh up to the positions.
inline void expect_same_elements(const MeshFile& a, const MeshFile& b) {
  ASSERT_EQ(a.mesh.blocks.size(), b.mesh.blocks.size());
  for (std::size_t block = 0; block < a.mesh.blocks.size(); ++block) {
    EXPECT_EQ(a.mesh.blocks[block].nodes, b.mesh.blocks[block].nodes);
  }
  EXPECT_EQ(find_node_set(a, kFixedArray), find_node_set(b, kFixedArray));
}

inline void expect_valid(const MeshFile& file) {
  const MeshTopology topology(file.mesh);
  EXPECT_NO_THROW(validate(topology.view(), file.mesh.positions_view()));
  const QualityStats quality = measure_quality(file.mesh);
  EXPECT_EQ(quality.inverted_count, 0);
  EXPECT_EQ(quality.degenerate_count, 0);
}

/// Of all bits of positions and elements.
inline std::uint64_t hash_of(const Mesh& mesh) {
  std::uint64_t hash = 0;
  const auto add = [&](std::uint64_t bits) { hash = mixed_bits(hash ^ bits); };
  for (const Vec3d& node : nodes_of(mesh)) {
    for (const double x : {node.x, node.y, node.z}) add(std::bit_cast<std::uint64_t>(x));
  }
  for (const ElementBlock& block : mesh.blocks) {
    for (const NodeId node : block.nodes) add(static_cast<std::uint64_t>(node));
  }
  return hash;
}

/// What the error says; "none" when there is none.
inline std::string error_of(auto make) {
  try {
    (void)make();
  } catch (const InvalidOption& error) {
    return error.what();
  }
  return "none";
}

}  // namespace meshsmooth::formats

// How nodes are placed by the edges of their mesh, before a topology that is kept on the device is
// ordered by these places.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "gpu/steps/cuda_steps.hpp"
#include "gpu/steps/step_meshes.hpp"
#include "support/cuda_device.hpp"

namespace meshsmooth {
namespace {

using test::as_lists;
using testing::ElementsAre;

class CudaPlacesByEdges : public test::CudaTest {};

using Rings = std::vector<std::vector<NodeId>>;

/// Nodes in a row, each beside the next.
Rings chain(int length) {
  Rings rings(static_cast<std::size_t>(length));
  for (NodeId n = 0; n + 1 < length; ++n) {
    rings[static_cast<std::size_t>(n)].push_back(n + 1);
    rings[static_cast<std::size_t>(n) + 1].push_back(n);
  }
  return rings;
}

/// Steps along edges from a node to each; -1 where there is no way.
std::vector<int> count_steps(const Rings& rings, NodeId from) {
  std::vector<int> steps(rings.size(), -1);
  std::vector<NodeId> reached = {from};
  steps[static_cast<std::size_t>(from)] = 0;
  for (std::size_t k = 0; k < reached.size(); ++k) {
    const auto node = static_cast<std::size_t>(reached[k]);
    for (const NodeId neighbour : rings[node]) {
      int& there = steps[static_cast<std::size_t>(neighbour)];
      if (there >= 0) continue;
      there = steps[node] + 1;
      reached.push_back(neighbour);
    }
  }
  return steps;
}

/// The first of the nodes with neighbours that are farthest; no way is farther than any.
NodeId find_farthest(const Rings& rings, const std::vector<int>& steps) {
  NodeId farthest = -1;
  const auto distance = [&](NodeId node) {
    return static_cast<unsigned>(steps[static_cast<std::size_t>(node)]);
  };
  for (NodeId node = 0; node < static_cast<NodeId>(rings.size()); ++node) {
    if (rings[static_cast<std::size_t>(node)].empty()) continue;
    if (farthest < 0 || distance(node) > distance(farthest)) farthest = node;
  }
  return farthest;
}

TEST_F(CudaPlacesByEdges, TakeLandmarksFarFromOneAnother) {
  for (const auto& [name, mesh] : test::topology_meshes()) {
    const Rings rings = as_lists(test::oracle::rings(mesh));

    const test::DeviceLandmarks found = test::place_by_edges_on_device(rings);

    const NodeId any = find_farthest(rings, std::vector<int>(rings.size(), 0));
    std::vector<int> nearest = count_steps(rings, any);
    for (std::size_t k = 0; k < found.nodes.size(); ++k) {
      ASSERT_EQ(found.nodes[k], find_farthest(rings, nearest)) << name << ", landmark " << k;
      const std::vector<int> steps = count_steps(rings, found.nodes[k]);
      ASSERT_EQ(found.steps[k], steps) << name << ", landmark " << k;
      for (std::size_t n = 0; n < steps.size(); ++n) {
        if (k == 0 || static_cast<unsigned>(steps[n]) < static_cast<unsigned>(nearest[n])) {
          nearest[n] = steps[n];
        }
      }
    }
  }
}

TEST_F(CudaPlacesByEdges, StretchAChainToALine) {
  const test::DeviceLandmarks found = test::place_by_edges_on_device(chain(40));

  EXPECT_THAT(found.nodes, ElementsAre(39, 0, 19, 29, 9, 14, 24, 34));
  for (std::size_t a = 0; a < 40; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_NEAR(norm(found.places[a] - found.places[b]), double(a - b), 0.01) << a << ", " << b;
    }
  }
}

/// The places of the landmarks are scaled eigenvectors of their doubly centred squared distances,
/// those of other nodes follow from the distances to the landmarks (de Silva and Tenenbaum).
TEST_F(CudaPlacesByEdges, ScaleTheDistances) {
  for (const auto& [name, mesh] : test::topology_meshes()) {
    const Rings rings = as_lists(test::oracle::rings(mesh));
    const test::DeviceLandmarks found = test::place_by_edges_on_device(rings);
    const std::size_t count = found.nodes.size();
    int longest = 0;
    for (const auto& steps : found.steps) {
      for (const NodeId node : found.nodes) {
        longest = std::max(longest, steps[static_cast<std::size_t>(node)]);
      }
    }
    const auto square = [&](std::size_t landmark, std::size_t node) {
      const int steps = found.steps[landmark][node];
      const double distance = steps < 0 ? std::max(1, 2 * longest) : steps;
      return distance * distance;
    };
    const auto node_of = [&](std::size_t k) { return static_cast<std::size_t>(found.nodes[k]); };
    std::vector<double> means(count, 0.0);
    double mean = 0, trace = 0;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) {
        means[i] += square(i, node_of(j)) / double(count);
      }
      mean += means[i] / double(count);
    }
    const auto centred = [&](std::size_t i, std::size_t j) {
      return -0.5 * (square(i, node_of(j)) - means[i] - means[j] + mean);
    };
    for (std::size_t i = 0; i < count; ++i) trace += std::abs(centred(i, i));

    double last = HUGE_VAL;
    for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
      const auto at = [&](std::size_t k) { return found.places[node_of(k)].*axis; };
      double eigenvalue = 0;
      for (std::size_t k = 0; k < count; ++k) eigenvalue += at(k) * at(k);
      EXPECT_LE(eigenvalue, last * 1.01 + 1e-6 * trace) << name;
      last = eigenvalue;
      for (std::size_t i = 0; i < count; ++i) {
        double product = 0;
        for (std::size_t j = 0; j < count; ++j) product += centred(i, j) * at(j);
        EXPECT_NEAR(product, eigenvalue * at(i), 0.02 * trace * std::sqrt(trace)) << name;
      }
      for (std::size_t n = 0; n < rings.size() && eigenvalue > 1e-3 * trace; ++n) {
        double place = 0;
        for (std::size_t k = 0; k < count; ++k) {
          place += at(k) / (2 * eigenvalue) * (means[k] - square(k, n));
        }
        ASSERT_NEAR(found.places[n].*axis, place, 0.01 * std::sqrt(trace))
            << name << ", node " << n;
      }
    }
  }
}

TEST_F(CudaPlacesByEdges, KeepNodesNearThatAreNearAlongEdges) {
  const Mesh mesh = test::lattice(ElementType::tetrahedron, 12);
  const Rings rings = as_lists(test::oracle::rings(mesh));
  const auto& places = test::place_by_edges_on_device(rings).places;

  double to_neighbours = 0, to_any = 0;
  std::size_t neighbours = 0, any = 0;
  for (std::size_t n = 0; n < rings.size(); ++n) {
    for (const NodeId neighbour : rings[n]) {
      to_neighbours += norm(places[n] - places[static_cast<std::size_t>(neighbour)]);
      ++neighbours;
    }
    for (std::size_t other = 0; other < rings.size(); other += 7) {
      to_any += norm(places[n] - places[other]);
      ++any;
    }
  }
  EXPECT_LT(to_neighbours / double(neighbours), 0.25 * to_any / double(any));
}

TEST_F(CudaPlacesByEdges, EndTheSearchOfALongChain) {
  const test::DeviceLandmarks found = test::place_by_edges_on_device(chain(5000));

  EXPECT_EQ(found.nodes[0], 4096);  // the first that the search from node 0 leaves out
  EXPECT_EQ(found.nodes[1], 0);
  EXPECT_EQ(found.steps[1][4095], 4095);
  EXPECT_EQ(found.steps[1][4096], -1);
  for (const Vec3d& place : found.places) {
    ASSERT_TRUE(std::isfinite(place.x + place.y + place.z));
  }
}

}  // namespace
}  // namespace meshsmooth

// Derivatives of Move on any backend.

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/smoothing.hpp"

namespace meshsmooth::test::derivatives {

using Vectors = std::vector<Vec3d>;

inline Vectors random_vectors(std::size_t count, unsigned seed) {
  std::mt19937 engine(seed);
  const auto number = [&] { return static_cast<double>(engine()) / 2147483648.0 - 1; };
  Vectors vectors(count);
  for (Vec3d& v : vectors) v = {number(), number(), number()};
  return vectors;
}

inline double product(const Vectors& a, const Vectors& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += dot(a[n], b[n]);
  return sum;
}
inline double length(const Vectors& a) { return std::sqrt(product(a, a)); }

inline double largest_difference(const Vectors& a, const Vectors& b) {
  double largest = 0;
  for (std::size_t n = 0; n < a.size(); ++n) largest = std::max(largest, norm(a[n] - b[n]));
  return largest;
}

/// A reference, the nodes that are prescribed, and what its boundary does.
struct Case {
  std::string name;
  Mesh reference;
  std::vector<NodeId> nodes;
  BoundaryPolicy boundary = BoundaryPolicy::fixed;
};

struct Where {
  const char* backend = "cpu";
  int threads = 2;
};

struct Derivatives {
  Vectors vectors;  // of all nodes
  SmoothSummary summary;
};

inline SmoothOptions options_of(const Case& of, Derivative derivative) {
  return {.method = Move{.derivative = derivative}, .boundary = of.boundary};
}

inline Derivatives run(const Case& of, const SmoothOptions& options, const JobInput& input,
                       const Where& where = {}) {
  Derivatives result{Vectors(of.reference.node_count()), {}};
  const MeshTopology topology(of.reference);
  JobPositions arrays(of.reference.positions_view(), std::span(result.vectors));
  arrays.input = input;
  result.summary =
      make_smoother(where.backend, where.threads)->smooth(topology.view(), arrays, options, {});
  return result;
}

inline Derivatives tangent(const Case& of, const Vectors& u, const Where& where = {}) {
  return run(of, options_of(of, Derivative::tangent),
             {.prescribed = {of.nodes, std::span<const Vec3d>(u)}}, where);
}
inline Derivatives cotangent(const Case& of, const Vectors& w, const Where& where = {}) {
  return run(of, options_of(of, Derivative::cotangent),
             {.prescribed = {of.nodes, {}}, .cotangent = std::span<const Vec3d>(w)}, where);
}

inline Vectors at(const std::vector<NodeId>& nodes, const Vectors& vectors) {
  Vectors chosen;
  for (const NodeId node : nodes) chosen.push_back(vectors[static_cast<std::size_t>(node)]);
  return chosen;
}

/// The nodes that a condition chooses.
template <class Chooses>
std::vector<NodeId> nodes_where(const Mesh& mesh, const Chooses& chooses) {
  std::vector<NodeId> nodes;
  for (std::size_t n = 0; n < mesh.node_count(); ++n) {
    if (chooses(points(mesh)[n])) nodes.push_back(static_cast<NodeId>(n));
  }
  return nodes;
}

inline Case whole_boundary(const std::string& name, Mesh mesh) {
  Case result{name, std::move(mesh), {}};
  result.nodes = find_boundary_nodes(MeshTopology(result.reference).view());
  return result;
}
/// The lower side of a unit cube or square is prescribed.
inline Case one_side(const std::string& name, Mesh mesh, BoundaryPolicy boundary) {
  Case result{name, std::move(mesh), {}, boundary};
  const bool flat = element_shape(result.reference.blocks.front().type).dimension == 2;
  result.nodes = nodes_where(result.reference, [&](Vec3d p) { return (flat ? p.y : p.z) < 1e-9; });
  return result;
}

inline void expect_transposes(const Case& of, const Where& where = {}) {
  SCOPED_TRACE(of.name);
  const Vectors u = random_vectors(of.nodes.size(), 1);
  const Vectors w = random_vectors(of.reference.node_count(), 2);
  const Derivatives forward = tangent(of, u, where);
  const Derivatives reverse = cotangent(of, w, where);
  const double of_forward = product(forward.vectors, w);
  const double of_reverse = product(u, at(of.nodes, reverse.vectors));
  EXPECT_NEAR(of_forward, of_reverse, 1e-12 * length(forward.vectors) * length(w));
  EXPECT_NEAR(of_forward, of_reverse, 1e-12 * std::abs(of_forward));
  for (const Derivatives* result : {&forward, &reverse}) {
    EXPECT_LE(result->summary.motion.value().linear_residual, 1e-13);
    EXPECT_EQ(result->summary.motion->reached, 1);
  }
  Vectors others = reverse.vectors;
  for (const NodeId node : of.nodes) others[static_cast<std::size_t>(node)] = {0, 0, 0};
  EXPECT_EQ(length(others), 0);
  EXPECT_EQ(at(of.nodes, forward.vectors), u);
}

}  // namespace meshsmooth::test::derivatives

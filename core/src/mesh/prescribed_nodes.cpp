#include <cmath>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth {
namespace {

[[noreturn]] void refuse_prescribed(const char* reason, std::size_t place, NodeId node,
                                    const std::string& why) {
  throw InvalidMesh(
      reason,
      "prescribed node " + std::to_string(node) + " at index " + std::to_string(place) + ": " + why,
      {{"node", std::to_string(node)}});
}

template <class Real>
bool is_finite(const Vec3<Real>& vector) {
  return std::isfinite(vector.x) && std::isfinite(vector.y) && std::isfinite(vector.z);
}

void validate_nodes(const TopologyView& topology, std::span<const NodeId> nodes) {
  if (nodes.empty()) {
    throw InvalidOption("OPTION_OUT_OF_RANGE", "move needs at least one prescribed node",
                        {{"field", "prescribed"}});
  }
  std::vector<bool> seen(topology.node_count);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const NodeId node = nodes[n];
    if (node < 0 || static_cast<std::size_t>(node) >= topology.node_count) {
      refuse_prescribed(
          "INDEX_OUT_OF_RANGE", n, node,
          "it is out of range, the mesh has " + std::to_string(topology.node_count) + " nodes");
    }
    const auto id = static_cast<std::size_t>(node);
    if (seen[id]) refuse_prescribed("PRESCRIBED_TWICE", n, node, "it occurs more than once");
    seen[id] = true;
    if (!topology.fixed.empty() && topology.fixed[id] != 0) {
      refuse_prescribed("PRESCRIBED_AND_FIXED", n, node,
                        "it is fixed too; prescribe it or fix it, not both");
    }
  }
}

/// Positions or tangents of the prescribed nodes.
void validate_vectors(const PositionsView& vectors, std::span<const NodeId> nodes) {
  if (position_count(vectors) != nodes.size()) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                      std::to_string(nodes.size()) + " prescribed nodes, but " +
                          std::to_string(position_count(vectors)) + " positions",
                      {{"array", "prescribed"}});
  }
  std::visit(
      [&](const auto& given) {
        for (std::size_t n = 0; n < nodes.size(); ++n) {
          if (is_finite(given[n])) continue;
          refuse_prescribed("NON_FINITE_COORDINATE", n, nodes[n], "its position is not finite");
        }
      },
      vectors);
}

}  // namespace

void validate_prescribed(const TopologyView& topology, const PrescribedNodes& prescribed) {
  validate_nodes(topology, prescribed.nodes);
  validate_vectors(prescribed.positions, prescribed.nodes);
}

void validate_motion(const TopologyView& topology, const SmoothOptions& options,
                     const JobInput& input) {
  const PrescribedNodes& prescribed = input.prescribed;
  if (derivative_of(options.method) != Derivative::cotangent) {
    return validate_prescribed(topology, prescribed);
  }
  validate_nodes(topology, prescribed.nodes);
  if (position_count(prescribed.positions) > 0) {
    throw NotSupported("OPTION_NOT_SUPPORTED",
                       "cotangents need no positions of the prescribed nodes; leave them out",
                       {{"field", "prescribed"}});
  }
  if (position_count(input.cotangent) != topology.node_count) {
    throw InvalidMesh("ARRAY_SIZE_MISMATCH",
                      std::to_string(position_count(input.cotangent)) +
                          " cotangents, but the mesh has " + std::to_string(topology.node_count) +
                          " nodes",
                      {{"array", "cotangent"}});
  }
  std::visit(
      [](const auto& cotangents) {
        for (std::size_t n = 0; n < cotangents.size(); ++n) {
          if (is_finite(cotangents[n])) continue;
          throw InvalidMesh("NON_FINITE_COORDINATE",
                            "node " + std::to_string(n) + ": its cotangent is not finite",
                            {{"node", std::to_string(n)}});
        }
      },
      input.cotangent);
}

}  // namespace meshsmooth

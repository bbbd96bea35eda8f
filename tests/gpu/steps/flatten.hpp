#pragma once

// From a mesh to a `FlatMesh`, by the oracle.

#include <algorithm>
#include <numeric>

#include "gpu/steps/flat_mesh.hpp"
#include "smooth/base/colouring_rule.hpp"
#include "support/oracle.hpp"

namespace meshsmooth::test {

/// Rows that ascend by the callers' ids, of one per node in internal order.
template <class Set, class Id, class Internal>
void flatten_rows(const FlatMesh& flat, const std::vector<Set>& sets, const Internal& internal,
                  std::vector<std::int64_t>& offsets, std::vector<Id>& entries) {
  offsets.assign(1, 0);
  for (const NodeId caller : flat.caller_ids) {
    for (const auto id : sets[static_cast<std::size_t>(caller)]) entries.push_back(internal(id));
    offsets.push_back(static_cast<std::int64_t>(entries.size()));
  }
}

inline FlatMesh flatten(const Mesh& mesh, bool boundary_fixed = true) {
  const auto count = static_cast<NodeId>(mesh.node_count());
  const auto internal = [=](NodeId caller) { return count - 1 - caller; };
  const std::vector<Vec3d> positions = points_as_double(mesh);
  const std::vector<bool> held = oracle::held_nodes(mesh, boundary_fixed);
  FlatMesh flat;
  Eigen::AlignedBox3d box;
  for (NodeId n = 0; n < count; ++n) {
    const NodeId caller = internal(n);
    flat.caller_ids.push_back(caller);
    flat.positions.push_back(positions[static_cast<std::size_t>(caller)]);
    flat.fixed.push_back(held[static_cast<std::size_t>(caller)] ? 1 : 0);
    box.extend(oracle::to_point(flat.positions.back()));
  }
  flat.diagonal = box.diagonal().norm();

  const std::vector<oracle::Element> elements = oracle::elements(mesh);
  flat.dimension = oracle::is_surface(elements.front().type) ? 2 : 3;
  std::vector<std::uint32_t> internal_element(elements.size());
  for (const ElementType type : kLinearTypes) {
    FlatMesh::Run run{type, {}};
    for (std::size_t e = 0; e < elements.size(); ++e) {
      if (elements[e].type != type) continue;
      internal_element[e] = static_cast<std::uint32_t>(flat.element_caller_ids.size());
      flat.element_caller_ids.push_back(static_cast<std::uint32_t>(e));
      for (const NodeId n : elements[e].nodes) run.nodes.push_back(internal(n));
    }
    if (!run.nodes.empty()) flat.runs.push_back(std::move(run));
  }
  flatten_rows(flat, oracle::rings(mesh), internal, flat.ring_offsets, flat.ring_entries);
  flatten_rows(
      flat, oracle::balls(mesh),
      [&](std::int64_t e) { return internal_element[static_cast<std::size_t>(e)]; },
      flat.ball_offsets, flat.ball_entries);

  flat.colour_first.push_back(0);
  for (std::vector<NodeId> colour : oracle::colours(mesh, held, detail::colour_priority)) {
    std::transform(colour.begin(), colour.end(), colour.begin(), internal);
    std::sort(colour.begin(), colour.end());
    flat.colour_nodes.insert(flat.colour_nodes.end(), colour.begin(), colour.end());
    flat.colour_first.push_back(flat.colour_nodes.size());
  }
  if (flat.dimension == 2) {
    const MeshTopology topology(mesh);
    const SurfaceOrientation orientation(topology.view(), mesh.positions_view());
    flat.reference = orientation.common();
    for (const std::uint32_t caller : flat.element_caller_ids) {
      if (orientation.normals().empty()) break;
      flat.references.push_back(orientation.normals()[caller]);
    }
  }
  return flat;
}

}  // namespace meshsmooth::test

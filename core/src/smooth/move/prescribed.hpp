#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/smoother.hpp"
#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/base/positions.hpp"

namespace meshsmooth::detail {

/// Where the nodes of a job lie at first. Positions of the other type are copied to `result`.
template <class Real>
[[nodiscard]] std::span<const Vec3<Real>> given_positions(const JobPositions& positions,
                                                          std::span<Vec3<Real>> result) {
  if (const auto* same = std::get_if<std::span<const Vec3<Real>>>(&positions.given)) return *same;
  std::visit(
      [&](const auto& given) {
        std::ranges::transform(given, result.begin(),
                               [](const auto& p) { return vec3_cast<Real>(p); });
      },
      positions.given);
  return result;
}

template <class Real>
[[nodiscard]] bool is_same_array(const PositionsView& known, std::span<const Vec3<Real>> given) {
  const auto* same = std::get_if<std::span<const Vec3<Real>>>(&known);
  return same != nullptr && same->data() == given.data() && same->size() == given.size();
}
[[nodiscard]] inline bool is_same_array(const PositionsView& known, const PositionsView& given) {
  return std::visit([&](const auto& positions) { return is_same_array(known, positions); }, given);
}

/// Checks the sizes of the caller's positions.
inline void validate_sizes(const TopologyView& topology, const JobPositions& positions,
                           const SmoothOptions& options) {
  validate_sizes(topology, as_view(positions.result));
  validate_sizes(topology, positions.given);
  const bool moves = is_motion(options.method);
  if (!moves && positions.given.index() != positions.result.index()) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "positions: the result is of another type than what is given",
                        {{"field", "positions"}});
  }
}

/// The same, and what the positions are. `known`: positions that have been checked.
inline void validate_given(const TopologyView& topology, const JobPositions& positions,
                           const SmoothOptions& options, const PositionsView& known = {}) {
  validate_sizes(topology, positions, options);
  if (!is_same_array(known, positions.given)) validate_positions(topology, positions.given);
}

/// Checks what else a job is given.
inline void validate_input(const TopologyView& topology, const JobInput& input,
                           const SmoothOptions& options) {
  if (aims_at_reference(options)) validate_reference(topology, input.reference);
  if (is_motion(options.method)) validate_motion(topology, options, input);
}

/// The topology of a job. The nodes that `Move` prescribes are fixed in it, like those of the
/// caller; what lies between regions follows like all else. What it views must outlive it.
class JobTopology {
 public:
  JobTopology(const TopologyView& topology, const SmoothOptions& options,
              const PrescribedNodes& prescribed)
      : view_(topology) {
    if (!is_motion(options.method)) return;
    if (topology.fixed.empty()) {
      fixed_.resize(topology.node_count);
    } else {
      fixed_.assign(topology.fixed.begin(), topology.fixed.end());
    }
    for (const NodeId node : prescribed.nodes) fixed_[static_cast<std::size_t>(node)] = 1;
    view_.fixed = fixed_;
    view_.regions = {};
  }
  JobTopology(const JobTopology&) = delete;
  JobTopology& operator=(const JobTopology&) = delete;

  [[nodiscard]] const TopologyView& view() const { return view_; }

 private:
  std::vector<std::uint8_t> fixed_;
  TopologyView view_;
};

/// The prescribed nodes in internal numbers, with the positions where the motion begins and ends.
template <Executor E, class Real>
struct Prescribed {
  std::size_t count = 0;
  typename E::template Buffer<NodeId> nodes;
  typename E::template Buffer<Vec3<Real>> from, to;
};

/// Fills `result` from the caller's arrays, for `find_prescribed`.
template <Executor E, class Real, class Given>
void number_prescribed(E& executor, std::span<const NodeId> ids,
                       std::span<const Vec3<Given>> positions, const NodeId* internal_of,
                       const Vec3<Real>* reference, Prescribed<E, Real>& result) {
  const auto id_array = executor.in_executor_memory(ids);
  const auto position_array = executor.in_executor_memory(positions);
  const NodeId* const callers = id_array.data();
  const Vec3<Given>* const given = position_array.data();
  NodeId* const nodes = result.nodes.data();
  Vec3<Real>* const from = result.from.data();
  Vec3<Real>* const to = result.to.data();
  executor.for_each(ids.size(), [=] MESHSMOOTH_HD(std::size_t n) {
    nodes[n] = internal_of[callers[n]];
    from[n] = reference[nodes[n]];
    to[n] = vec3_cast<Real>(given[n]);
  });
}

/// The internal node of each of the caller's. O(nodes).
template <Executor E, class Real>
typename E::template Buffer<NodeId> find_internal_ids(E& executor, const JobMesh<E, Real>& job) {
  auto internal = executor.template allocate<NodeId>(job.node_count);
  NodeId* const internal_of = internal.data();
  const NodeId* const caller_ids = job.caller_ids.data();
  executor.for_each(job.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    internal_of[caller_ids[node]] = static_cast<NodeId>(node);
  });
  return internal;
}

/// cost   O(nodes); 4 B a node while it runs
template <Executor E, class Real>
Prescribed<E, Real> find_prescribed(E& executor, const JobMesh<E, Real>& job,
                                    const PrescribedNodes& prescribed) {
  Prescribed<E, Real> result;
  const std::size_t count = result.count = prescribed.nodes.size();
  result.nodes = executor.template allocate<NodeId>(count);
  result.from = executor.template allocate<Vec3<Real>>(count);
  result.to = executor.template allocate<Vec3<Real>>(count);
  const auto internal = find_internal_ids(executor, job);
  std::visit(
      [&](const auto& given) {
        number_prescribed(executor, prescribed.nodes, given, internal.data(),
                          static_cast<const Vec3<Real>*>(job.positions.data()), result);
      },
      prescribed.positions);
  return result;
}

}  // namespace meshsmooth::detail

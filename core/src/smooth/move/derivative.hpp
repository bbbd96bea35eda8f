#pragma once

#include <algorithm>
#include <cstdint>

#include "smooth/linear/kept_reference.hpp"
#include "smooth/linear/refine_laplace.hpp"
#include "smooth/linear/solving_backend.hpp"
#include "smooth/move/prescribed.hpp"

namespace meshsmooth::detail {

/// Bytes of `LinearDerivative`: what it is given, the solution and the solver; then the result.
[[nodiscard]] inline std::int64_t derivative_bytes(const MeshCounts& mesh, bool kept) {
  constexpr std::int64_t kVector = sizeof(Vec3d);
  const std::int64_t numbers = 2 * mesh.nodes * std::int64_t{sizeof(NodeId)};
  const std::int64_t reached = mesh.nodes * std::int64_t{sizeof(std::uint32_t)};
  const std::int64_t solving = refining_bytes(mesh, kept);
  const std::int64_t result = mesh.nodes * mesh.position_bytes;
  return numbers + 2 * mesh.nodes * kVector +
         std::max({mesh.nodes * kVector, reached, solving, result});
}

/// Clears a vector at the nodes of parts of the mesh that no fixed node belongs to: there Laplace's
/// matrix is singular, and no prescribed node has an influence.
///
/// cost   O(edges), times the diameter of the mesh in edges at most
/// order  deterministic: what is reached does not depend on the order
template <Executor E>
void clear_floating_parts(E& executor, const Surroundings& around, Vec3d* vector) {
  auto marks = executor.template allocate<std::uint32_t>(around.node_count);
  std::uint32_t* const reached = marks.data();
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    reached[node] = around.fixed[node] != 0 ? 1 : 0;
  });
  const auto spread = [=] MESHSMOOTH_HD(std::size_t node) {
    if (E::load(reached[node]) != 0) return std::int64_t{0};
    const NodeId* const end = around.rings.end(node);
    for (const NodeId* other = around.rings.begin(node); other != end; ++other) {
      if (E::load(reached[*other]) == 0) continue;
      E::store(reached[node], std::uint32_t{1});
      return std::int64_t{1};
    }
    return std::int64_t{0};
  };
  while (executor.reduce(around.node_count, std::int64_t{0}, spread, Plus{}) > 0) executor.check();
  executor.for_each(around.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
    if (reached[node] == 0) vector[node] = Vec3d{0, 0, 0};
  });
}

/// Products with the Jacobian matrix J of `Move`'s linear prediction on the reference: from the
/// displacements of the prescribed nodes to those of all. With Laplace's matrix A, P the projection
/// of free nodes on what their constraints allow, and f and p for free and prescribed nodes,
///
///     J = [I; -(P A_ff P)^+ P A_fp],  so that  J^T w = w_p - A_pf (P A_ff P)^+ P w_f:
///
/// the same solution with the same symmetric matrix. Other fixed nodes neither move nor count.
template <SolvingBackend B, class Real>
class LinearDerivative {
 public:
  using E = typename B::Executor;

  /// What it refers to must outlive it; the job's positions are those of the reference.
  LinearDerivative(B& backend, const Surroundings& around, const JobMesh<E, Real>& job,
                   const JobInput& input)
      : backend_(backend),
        executor_(backend.executor()),
        around_(around),
        job_(job),
        input_(input),
        prescribed_count_(input.prescribed.nodes.size()),
        prescribed_(executor_.template allocate<NodeId>(prescribed_count_)),
        solution_(executor_.template allocate<Vec3d>(job.node_count)) {
    number_nodes();
    clear(solution_.data());
  }

  /// The tangents of all nodes for those of the prescribed ones, in the caller's order.
  void tangent(MotionStats& stats, std::span<Vec3<Real>> result) {
    Vec3d* const x = solution_.data();
    const NodeId* const nodes = prescribed_.data();
    const typename E::Timer timer(executor_, stats.linear_seconds);
    std::visit([&](const auto& tangents) { scatter(tangents, nodes, x); },
               input_.prescribed.positions);
    solve(nullptr, stats);
    write(x, result);
  }

  /// The cotangents of the prescribed nodes for those of all, 0 at the others, in the caller's
  /// order. `may_float`: parts of the mesh may have no fixed node.
  void cotangent(bool may_float, MotionStats& stats, std::span<Vec3<Real>> result) {
    auto given = executor_.template allocate<Vec3d>(job_.node_count);
    Vec3d* const right = given.data();
    const typename E::Timer timer(executor_, stats.linear_seconds);
    std::visit([&](const auto& cotangents) { gather(cotangents, right); }, input_.cotangent);
    if (may_float) clear_floating_parts(executor_, around_, right);
    solve(right, stats);
    write(right, result);
  }

  /// The prescribed nodes in internal numbers.
  void number_nodes() {
    const auto internal = find_internal_ids(executor_, job_);
    const auto ids = executor_.in_executor_memory(input_.prescribed.nodes);
    const NodeId* const internal_of = internal.data();
    const NodeId* const callers = ids.data();
    NodeId* const nodes = prescribed_.data();
    executor_.for_each(prescribed_count_,
                       [=] MESHSMOOTH_HD(std::size_t n) { nodes[n] = internal_of[callers[n]]; });
  }
  /// Stores the vectors of the prescribed nodes.
  template <class Given>
  void scatter(std::span<const Vec3<Given>> vectors, const NodeId* nodes, Vec3d* to) {
    const auto array = executor_.in_executor_memory(vectors);
    const Vec3<Given>* const from = array.data();
    executor_.for_each(prescribed_count_, [=] MESHSMOOTH_HD(std::size_t n) {
      to[nodes[n]] = vec3_cast<double>(from[n]);
    });
  }
  /// Stores the vectors of all nodes in internal order.
  template <class Given>
  void gather(std::span<const Vec3<Given>> vectors, Vec3d* to) {
    const auto array = executor_.in_executor_memory(vectors);
    const Vec3<Given>* const from = array.data();
    const NodeId* const caller_ids = job_.caller_ids.data();
    executor_.for_each(job_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      to[node] = vec3_cast<double>(from[caller_ids[node]]);
    });
  }

  void clear(Vec3d* vector) {
    executor_.for_each(job_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      vector[node] = Vec3d{0, 0, 0};
    });
  }

  /// The solution for `right` at the free nodes. With it, `right` becomes the cotangents of the
  /// prescribed nodes.
  void solve(Vec3d* right, MotionStats& stats) {
    const std::size_t ring_entries = job_.rings.entries.size();
    const Vec3<Real>* const positions = job_.positions.data();
    const auto shared = find_system(backend_, around_, ring_entries, positions);
    RefinedSolver<E> solver(executor_, around_, ring_entries, positions, shared->system);
    const LinearStats linear = solver.solve(right, solution_.data());
    stats.linear_iteration_count = linear.iterations;
    stats.linear_residual = linear.residual;
    if (right != nullptr) keep_prescribed(solver.matrix(), right);
  }

  void keep_prescribed(const LaplaceMatrixOf<double>& matrix, Vec3d* right) {
    Vec3d* const y = solution_.data();
    const NodeId* const nodes = prescribed_.data();
    executor_.for_each(prescribed_count_, [=] MESHSMOOTH_HD(std::size_t n) {
      const auto node = static_cast<std::size_t>(nodes[n]);
      right[node] = right[node] - matrix.row(node, y, SingleThread());
    });
    executor_.for_each(prescribed_count_,
                       [=] MESHSMOOTH_HD(std::size_t n) { y[nodes[n]] = right[nodes[n]]; });
    const std::uint8_t* const fixed = around_.fixed;
    executor_.for_each(job_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      right[node] = fixed[node] != 0 ? y[node] : Vec3d{0, 0, 0};
    });
  }

  /// In the caller's order, to host memory: after the last chance to end without a result.
  void write(const Vec3d* vector, std::span<Vec3<Real>> result) {
    auto ordered = executor_.template allocate<Vec3<Real>>(job_.node_count);
    Vec3<Real>* const to = ordered.data();
    const NodeId* const caller_ids = job_.caller_ids.data();
    executor_.for_each(job_.node_count, [=] MESHSMOOTH_HD(std::size_t node) {
      to[caller_ids[node]] = vec3_cast<Real>(vector[node]);
    });
    executor_.synchronize();
    executor_.check();
    executor_.download(ordered.data(), job_.node_count, result.data());
  }

 private:
  B& backend_;
  E& executor_;
  const Surroundings& around_;
  const JobMesh<E, Real>& job_;
  const JobInput& input_;
  const std::size_t prescribed_count_;
  typename E::template Buffer<NodeId> prescribed_;  // internal ids
  typename E::template Buffer<Vec3d> solution_;
};

}  // namespace meshsmooth::detail

#pragma once

#include "smooth/base/mesh_counts.hpp"
#include "smooth/linear/multigrid.hpp"

namespace meshsmooth::detail {

/// Laplace's equation on a reference, for some fixed nodes: what many motions can share.
template <Executor E>
struct LaplaceSystem {
  typename E::template Buffer<float> values;   // by ring entry
  typename E::template Buffer<float> weights;  // by node; 0: it is fixed
  Hierarchy<E> hierarchy;

  /// Its rows are the rings.
  [[nodiscard]] LaplaceMatrix matrix(const Surroundings& around) const {
    return {around.rings, values.data()};
  }
};

/// Bytes of a matrix whose rows are the rings, and a number for each row.
[[nodiscard]] inline std::int64_t laplace_bytes(const MeshCounts& mesh) {
  return 2 * mesh.edges * std::int64_t{sizeof(float)} + mesh.nodes * std::int64_t{sizeof(float)};
}
/// Bytes of a hierarchy, an upper bound for ordinary meshes: a coarser level has a tenth to a fifth
/// of the rows, each with twice to four times as many entries.
[[nodiscard]] inline std::int64_t hierarchy_bytes(const MeshCounts& mesh) {
  return 170 * mesh.nodes + 4 * std::int64_t{kMostCoarsestRows * kMostCoarsestRows};
}
/// Bytes of `KeptReference`.
[[nodiscard]] inline std::int64_t kept_system_bytes(const MeshCounts& mesh) {
  const std::int64_t warm = 2 * mesh.nodes * std::int64_t{sizeof(Vec3f)};
  return laplace_bytes(mesh) + mesh.nodes + hierarchy_bytes(mesh) + warm;
}
/// Bytes of `LaplaceSolver` and its system; of one to be kept also while it is built.
[[nodiscard]] inline std::int64_t solving_bytes(const MeshCounts& mesh, bool kept) {
  const std::int64_t vectors = 4 * mesh.nodes * std::int64_t{sizeof(Vec3f)};
  if (!kept) return vectors + laplace_bytes(mesh);
  return kept_system_bytes(mesh) + std::max(vectors * 7 / 4, 110 * mesh.nodes);
}

struct FreeNodes {
  const std::uint8_t* fixed;
  [[nodiscard]] MESHSMOOTH_HD bool operator()(std::size_t node) const { return fixed[node] == 0; }
};

/// Assembles the matrix; a hierarchy if `kept`, for it pays from the second motion on.
template <Executor E, class Real>
LaplaceSystem<E> build_laplace_system(E& executor, const Surroundings& around,
                                      std::size_t ring_entries, const Vec3<Real>* positions,
                                      bool kept) {
  LaplaceSystem<E> system;
  system.values = executor.template allocate<float>(ring_entries);
  system.weights = executor.template allocate<float>(around.node_count);
  assemble_laplace(executor, around, positions, system.values.data());
  const LaplaceMatrix matrix = system.matrix(around);
  find_weights(executor, matrix, around.node_count, FreeNodes{around.fixed}, system.weights.data());
  if (kept) {
    system.hierarchy = build_hierarchy(executor, matrix, system.weights.data(), around.node_count);
  }
  return system;
}

}  // namespace meshsmooth::detail

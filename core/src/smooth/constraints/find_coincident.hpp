#pragma once

#include <cstring>

#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"

namespace meshsmooth::detail {

/// Emits the row of a node by a hash of its position; none of a node in no element. 0 and -0 are
/// the same coordinate.
template <class Real>
struct VisitPositionHash {
  const Vec3<Real>* positions;
  Rows<NodeId> rings;
  std::size_t row_count;

  template <class Emit>
  MESHSMOOTH_HD void operator()(std::size_t node, const Emit& emit) const {
    if (rings.size(node) == 0) return;
    const Vec3<Real> p = positions[node];
    const Real coordinates[3] = {p.x, p.y, p.z};
    std::uint64_t hash = 0;
    for (int c = 0; c < 3; ++c) {
      const double value = static_cast<double>(coordinates[c]) + 0.0;
      std::uint64_t bits = 0;
      memcpy(&bits, &value, sizeof(bits));
      hash = (hash ^ bits ^ (hash >> 29)) * 0x9e3779b97f4a7c15U;
    }
    emit(static_cast<NodeId>((hash >> 32) % row_count));
  }
};

/// Whether some nodes may have the same position: surely where it is false.
///
/// cost   O(nodes); `finding_coincident_bytes` while it runs
template <Executor E, class Real>
[[nodiscard]] bool may_have_coincident_nodes(E& executor, const JobMesh<E, Real>& job) {
  constexpr std::size_t kLongRow = 32;
  const std::size_t count = job.node_count;
  const Vec3<Real>* const positions = job.positions.data();
  const auto same_hash = group_items(executor, count, count,
                                     VisitPositionHash<Real>{positions, job.rings.view(), count},
                                     [=] MESHSMOOTH_HD(ElementId node) { return node; });
  const Rows<ElementId> rows = same_hash.view();
  return executor.reduce(
             count, std::int64_t{0},
             [=] MESHSMOOTH_HD(std::size_t row) -> std::int64_t {
               const ElementId* const begin = rows.begin(row);
               const ElementId* const end = rows.end(row);
               if (rows.size(row) > kLongRow) return 1;
               for (const ElementId* a = begin; a < end; ++a) {
                 for (const ElementId* b = begin; b < a; ++b) {
                   if (positions[*a] == positions[*b]) return 1;
                 }
               }
               return 0;
             },
             Plus{}) > 0;
}

[[nodiscard]] inline std::int64_t finding_coincident_bytes(const MeshCounts& mesh,
                                                           const SmoothOptions& options) {
  return options.boundary == BoundaryPolicy::fixed ? 0 : mesh.nodes * 16;
}

}  // namespace meshsmooth::detail

#pragma once

#include "smooth/base/job_mesh.hpp"
#include "smooth/base/mesh_counts.hpp"
#include "smooth/energy/box_lengths.hpp"

namespace meshsmooth::detail {

/// Bytes that `fix_outside` holds while it runs.
[[nodiscard]] inline std::int64_t only_below_bytes(const MeshCounts& mesh,
                                                   const SmoothOptions& options) {
  return options.only_below ? mesh.nodes * 4 : 0;
}

/// Marks the nodes of bad elements with 1.
template <int kDimension, Executor E, class Real>
void mark_bad(E& executor, const Surroundings& around, const Vec3<Real>* positions, double quality,
              std::int32_t* marks) {
  executor.for_each(around.elements.count, [=] MESHSMOOTH_HD(std::size_t e) {
    const ElementView element = around.elements[e];
    const double ratio = least_mean_ratio<kDimension>(
        *element.shape, [&](int n) { return vec3_cast<double>(positions[element.nodes[n]]); },
        around.reference_of(e),
        [&](int k) { return corner_target<kDimension>(around.targets, e, element, k); });
    if (!(ratio < quality)) return;
    for (int n = 0; n < element.shape->node_count; ++n) {
      E::store(marks[element.nodes[n]], std::int32_t{1});
    }
  });
}

/// Fixes all nodes but those that `OnlyBelow` names.
///
/// gives  `job.fixed` and the counts of the job's nodes
/// cost   O(elements + rings * entries); `only_below_bytes`
template <Executor E, class Real>
void fix_outside(E& executor, const Surroundings& around, const OnlyBelow& only,
                 JobMesh<E, Real>& job) {
  auto buffer = executor.template allocate<std::int32_t>(job.node_count);
  std::int32_t* const marks = buffer.data();
  executor.for_each(job.node_count, [=] MESHSMOOTH_HD(std::size_t node) { marks[node] = 0; });
  if (around.surface()) {
    mark_bad<2>(executor, around, job.positions.data(), only.quality, marks);
  } else {
    mark_bad<3>(executor, around, job.positions.data(), only.quality, marks);
  }
  for (std::int32_t ring = 1; ring <= only.rings; ++ring) {
    const std::int64_t more = executor.reduce(
        job.node_count, std::int64_t{0},
        [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
          if (marks[node] != 0) return 0;
          for (const NodeId* n = around.rings.begin(node); n != around.rings.end(node); ++n) {
            if (marks[*n] != ring) continue;
            E::store(marks[node], ring + 1);
            return 1;
          }
          return 0;
        },
        Plus{});
    if (more == 0) break;
  }
  std::uint8_t* const fixed = job.fixed.data();
  const std::int64_t count = executor.reduce(
      job.node_count, std::int64_t{0},
      [=] MESHSMOOTH_HD(std::size_t node) -> std::int64_t {
        if (marks[node] != 0 || fixed[node] != 0) return 0;
        fixed[node] = 1;
        return 1;
      },
      Plus{});
  job.nodes.outside_only_below = count;
  job.nodes.fixed += count;
  job.free_count -= static_cast<std::size_t>(count);
}

}  // namespace meshsmooth::detail

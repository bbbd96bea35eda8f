#pragma once

#include <algorithm>

#include "smooth/averaging/only_below.hpp"
#include "smooth/base/find_not_canonical.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/cpu/colouring.hpp"
#include "smooth/cpu/incidence.hpp"
#include "smooth/cpu/job_elements.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/fit/fit_bytes.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/pipeline/iterate.hpp"
#include "smooth/plan/memory_plan.hpp"

namespace meshsmooth::detail {

/// Bytes that the CPU backend keeps of a prepared topology; the steps know their parts.
[[nodiscard]] inline std::int64_t prepared_bytes(const MeshSize& size) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t bytes = mesh.nodes * (4 + 1) +  // caller's ids, boundary marks
                             element_bytes(mesh) + ball_bytes(mesh) + ring_bytes(mesh);
  return bytes + bytes / 50 + (size.reference ? kept_system_bytes(mesh) : 0);
}

/// Bytes of `CpuSuspects`, where a job finds them.
[[nodiscard]] inline std::int64_t suspects_bytes(const MeshCounts& mesh, const JobPlan& plan) {
  const bool finds = (plan.averages || plan.in_steps()) && mesh.only(4) && plan.acceptance.guard &&
                     !plan.acceptance.smart && !plan.colours;
  return finds ? mesh.nodes * 16 + mesh.elements * std::int64_t{sizeof(ElementId)} : 0;
}

/// The memory of a job on the CPU backend, from its sizes alone.
[[nodiscard]] inline MemoryPlan plan_memory(const JobPlan& plan, const MeshSize& size,
                                            int thread_count) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const std::int64_t rings = ring_bytes(mesh);
  const std::int64_t rows = ball_bytes(mesh) + rings;
  // A plane surface needs no normals.
  const std::int64_t normals =
      mesh.dimension == 2 ? mesh.elements * std::int64_t{sizeof(PackedDirection)} : 0;
  const std::int64_t prepared = rows + n;
  const std::int64_t oriented = prepared + normals;
  const std::int64_t found = n + normals + (plan.needs_balls ? rows : rings);
  const std::int64_t sweeping = iterate_bytes(mesh, plan) + suspects_bytes(mesh, plan);

  MemoryPlan memory;
  memory.kept = n * (mesh.position_bytes + 4) +  // positions, caller's ids
                element_bytes(mesh) + constraint_bytes(mesh, plan) + fit_bytes(size) +
                fit_host_bytes(size) + target_bytes(mesh, plan);
  memory.beside = (1 + thread_count) * (std::int64_t{192} << 10);
  using S = JobStage;
  memory[S::order_nodes] = n * 4 + renumbering_bytes(mesh);
  memory[S::find_neighbours] = rows + finding_rings_bytes(mesh);
  memory[S::find_boundary] = prepared;
  memory[S::find_coincident] = prepared + finding_coincident_bytes(mesh, plan.options);
  memory[S::find_reference] = prepared;
  memory[S::constrain] = oriented + constraining_bytes(mesh, plan);
  memory[S::measure_input] = oriented + enclosed_volume_bytes(mesh);
  memory[S::find_boxes] = oriented + finding_boxes_bytes(mesh, plan);
  memory[S::find_anchors] = oriented;
  memory[S::fix_outside] = oriented + only_below_bytes(mesh, plan.options);
  memory[S::colour] = oriented + (plan.colours ? colouring_nodes_bytes(n) : 0);
  memory[S::iterate] = found + (plan.colours ? colouring_bytes(n) : 0) +
                       (plan.moves ? moving_bytes(mesh, plan, size.reference, sweeping) : sweeping);
  memory[S::measure_result] = found + element_quality_bytes(mesh, plan.options);
  memory[S::keep_quality] =
      found - (plan.recounts_poor ? 0 : rings) + keep_quality_bytes(mesh, plan);
  memory[S::recount_poor] =
      plan.recounts_poor ? memory[S::iterate] + recount_poor_bytes(mesh, plan) : 0;
  return memory;
}

}  // namespace meshsmooth::detail

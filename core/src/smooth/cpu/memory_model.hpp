#pragma once

#include <algorithm>

#include "smooth/averaging/only_below.hpp"
#include "smooth/constraints/constrain.hpp"
#include "smooth/constraints/find_coincident.hpp"
#include "smooth/cpu/colouring.hpp"
#include "smooth/cpu/incidence.hpp"
#include "smooth/cpu/job_elements.hpp"
#include "smooth/energy/find_targets.hpp"
#include "smooth/fit/fit_bytes.hpp"
#include "smooth/guard/keep_quality.hpp"
#include "smooth/optimize/recount_poor.hpp"
#include "smooth/plan/iterate.hpp"
#include "smooth/plan/needs_balls.hpp"

namespace meshsmooth::detail {

/// Bytes that the CPU backend keeps of a prepared topology; the steps know their parts.
[[nodiscard]] inline std::int64_t prepared_bytes(const MeshSize& size) {
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t bytes = mesh.nodes * (4 + 1) +  // caller's ids, boundary marks
                             element_bytes(mesh) + ball_bytes(mesh) + ring_bytes(mesh);
  return bytes + bytes / 50 + (size.reference ? kept_system_bytes(mesh) : 0);
}

/// Bytes of `CpuSuspects`, where a job finds them.
[[nodiscard]] inline std::int64_t suspects_bytes(const MeshCounts& mesh,
                                                 const SmoothOptions& options) {
  const bool sweeps = !std::holds_alternative<Optimize>(options.method) &&
                      !std::holds_alternative<Move>(options.method) &&
                      !std::holds_alternative<WindowedSinc>(options.method);
  const bool finds = sweeps && mesh.only(4) && options.guard && !acceptance_of(options).smart &&
                     resolve_form(options) != Form::gauss_seidel;
  return finds ? mesh.nodes * 16 + mesh.elements * std::int64_t{sizeof(ElementId)} : 0;
}

/// Upper bound of the bytes of a job on the CPU backend, from its sizes alone: the highest of its
/// stages.
[[nodiscard]] inline std::int64_t estimate_bytes(const MeshSize& size, const SmoothOptions& given,
                                                 int thread_count) {
  const SmoothOptions options = sweeping_options(given);
  const MeshCounts mesh = count_mesh(size);
  const std::int64_t n = mesh.nodes;
  const std::int64_t kept = n * (mesh.position_bytes + 4) +  // positions, caller's ids
                            element_bytes(mesh) + constraint_bytes(mesh, options) +
                            fit_bytes(size, options) + target_bytes(mesh, options);
  const std::int64_t rings = ring_bytes(mesh);
  const std::int64_t rows = ball_bytes(mesh) + rings;
  const bool colours = resolve_form(options) == Form::gauss_seidel;
  // A plane surface needs no normals.
  const std::int64_t normals =
      mesh.dimension == 2 ? mesh.elements * std::int64_t{sizeof(PackedDirection)} : 0;
  const std::int64_t found = n + normals + (needs_balls(options) ? rows : rings);
  const std::int64_t sweeping = iterate_bytes(mesh, options) + suspects_bytes(mesh, options);
  const bool moves = std::holds_alternative<Move>(given.method);
  const std::int64_t iterating =
      found + (moves ? motion_bytes(mesh, given, size.reference, sweeping) : sweeping) +
      (colours ? colouring_bytes(n) : 0);
  const std::int64_t evaluating = found + element_quality_bytes(mesh, options);
  const bool recounts = may_recount_poor(options);
  const std::int64_t keeping = found - (recounts ? 0 : rings) + keep_quality_bytes(mesh, options);
  const std::int64_t recounting = recounts ? iterating + recount_poor_bytes(mesh, options) : 0;
  const std::int64_t peak =
      kept + std::max({n * 4 + renumbering_bytes(mesh), rows + finding_rings_bytes(mesh),
                       rows + n + (colours ? colouring_nodes_bytes(n) : 0),
                       rows + n + constraining_bytes(mesh, options),
                       rows + n + finding_coincident_bytes(mesh, options),
                       rows + n + normals + only_below_bytes(mesh, options),
                       rows + n + normals + finding_boxes_bytes(mesh, options), iterating,
                       evaluating, keeping, recounting});
  const std::int64_t histograms = (1 + thread_count) * (std::int64_t{192} << 10);
  return peak + peak / 50 + histograms;
}

}  // namespace meshsmooth::detail

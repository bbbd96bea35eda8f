#pragma once

#include <string>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::bench {

/// SHA-256 of the positions as they lie in memory.
[[nodiscard]] std::string positions_hash(const Mesh& mesh);

/// SHA-256 of positions, connectivity, fixed nodes and regions.
[[nodiscard]] std::string mesh_hash(const Mesh& mesh);

/// SHA-256 of both qualities and of the locked elements; real numbers by their bits.
[[nodiscard]] std::string quality_hash(const SmoothSummary& summary);

/// SHA-256 of what else the same job reports on every run: stop reason, sweeps and their figures,
/// node counts, deviation and colours. Times, memory and names of devices are left out.
[[nodiscard]] std::string course_hash(const SmoothSummary& summary);

[[nodiscard]] const char* stop_reason_name(StopReason reason);

}  // namespace meshsmooth::bench

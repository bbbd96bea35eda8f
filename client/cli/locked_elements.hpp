#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/summary.hpp"

namespace meshsmooth::cli {

/// One sentence about the elements whose nodes are all fixed; empty if there are none.
[[nodiscard]] std::string describe_locked(
    const LockedStats& locked, const std::function<std::int64_t(std::int64_t)>& file_element_id);

/// Why no node of a mesh can move and what to do, one sentence; empty if some can. O(n log n).
[[nodiscard]] std::string describe_locked_mesh(const Mesh& mesh, const SmoothSummary& summary,
                                               const SmoothOptions& options);

}  // namespace meshsmooth::cli

#pragma once

#include <cstdint>

namespace meshsmooth::detail {

/// @returns an upper bound of what `find_boundary_nodes` holds, its result included
[[nodiscard]] std::int64_t boundary_nodes_bytes(std::int64_t node_count, std::int64_t facet_count);

}  // namespace meshsmooth::detail

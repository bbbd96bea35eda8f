#pragma once

#include <cstddef>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {

/// Throws `InvalidOption` (OPTION_OUT_OF_RANGE) unless a generator can make
/// that many nodes.
inline void check_node_count(std::size_t node_count, std::size_t least) {
  constexpr std::size_t kMost = 100'000'000;
  if (node_count >= least && node_count <= kMost) return;
  throw InvalidOption("OPTION_OUT_OF_RANGE",
                      std::to_string(node_count) + " nodes is not in [" + std::to_string(least) +
                          ", " + std::to_string(kMost) + "]",
                      {{"field", "nodes"}});
}

}  // namespace meshsmooth::formats

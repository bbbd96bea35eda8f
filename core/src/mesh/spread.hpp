#pragma once

#include <cstddef>

namespace meshsmooth::detail {

/// Position `index` of 0 … `count` - 1 in an order in which what lies together is far apart.
/// Threads take consecutive positions: costly items that lie together, as curved elements do along
/// a boundary, fall to many of them. A bijection.
[[nodiscard]] inline std::size_t spread(std::size_t index, std::size_t count) {
  constexpr std::size_t kRows = 64;
  const std::size_t whole = count / kRows * kRows;
  return index < whole ? index % kRows * (whole / kRows) + index / kRows : index;
}

}  // namespace meshsmooth::detail

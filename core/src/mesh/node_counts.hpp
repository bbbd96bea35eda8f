#pragma once

#include <array>

#include "meshsmooth/element.hpp"

namespace meshsmooth::detail {

/// Nodes of an element by type, for code that needs them at compile time; element.cpp checks them
/// against the element table.
inline constexpr std::array<int, kElementTypeCount> kNodesPerElement = {3, 4, 4, 5, 6, 8};

}  // namespace meshsmooth::detail

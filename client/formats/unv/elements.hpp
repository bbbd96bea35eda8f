#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "cells.hpp"

namespace meshsmooth::formats::unv {

/// The cell that an element of this FE descriptor with so many nodes is; null: one that cannot be
/// smoothed. O(1).
[[nodiscard]] const CellKind* find_kind(std::int64_t descriptor, std::size_t node_count);

/// Whether elements of this descriptor may have a record of a beam's section before their nodes.
[[nodiscard]] bool may_have_section(std::int64_t descriptor);

/// The FE descriptor to write a cell with; none: I-deas has no such element.
[[nodiscard]] std::optional<int> descriptor_of(const CellKind& kind);

}  // namespace meshsmooth::formats::unv

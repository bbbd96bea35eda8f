#pragma once

#include <cstdint>
#include <vector>

#include "cgns/elements.hpp"
#include "cgns/tree.hpp"

namespace meshsmooth::formats {

/// Whether a section leaves out the nodes of its facets (they are all 0) and names the elements
/// whose facets they are.
[[nodiscard]] bool is_given_by_parents(const CgnsTree& tree, const CgnsSection& section,
                                       const std::vector<std::int64_t>& connectivity);

/// The connectivity of such a section, from the elements in the other sections of its zone.
[[nodiscard]] std::vector<std::int64_t> connectivity_by_parents(
    const CgnsTree& tree, const std::vector<CgnsSection>& sections, const CgnsSection& section);

}  // namespace meshsmooth::formats

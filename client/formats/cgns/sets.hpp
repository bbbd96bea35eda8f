#pragma once

#include <vector>

#include "cgns/elements.hpp"

namespace meshsmooth::formats {

/// Boundary conditions as sets of nodes, by their own names and by their families'.
void read_cgns_conditions(const CgnsTree& tree, const CgnsZone& zone, const CgnsElements& elements,
                          const PlainDataset& dataset, FileContent& content);

/// Connectivities between zones (ZoneGridConnectivity) as sets of nodes, by their names.
/// @returns their nodes, which must stay where the other zone has them, in any order.
[[nodiscard]] std::vector<NodeId> read_cgns_interfaces(const CgnsTree& tree,
                                                       const std::vector<CgnsZone>& zones,
                                                       const CgnsElements& elements,
                                                       const PlainDataset& dataset,
                                                       FileContent& content);

}  // namespace meshsmooth::formats

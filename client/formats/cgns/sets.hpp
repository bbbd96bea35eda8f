#pragma once

#include <vector>

#include "cgns/elements.hpp"

namespace meshsmooth::formats {

/// Boundary conditions as sets of nodes, by their own names and by their families'.
void read_cgns_conditions(const CgnsTree& tree, const CgnsZone& zone, const CgnsElements& elements,
                          const PlainDataset& dataset, FileContent& content);

/// Connectivities between zones (ZoneGridConnectivity), periodic or not, as sets of nodes, by their
/// names, and as pairs with the nodes of the other zone.
void read_cgns_interfaces(const CgnsTree& tree, const std::vector<CgnsZone>& zones,
                          const CgnsElements& elements, const PlainDataset& dataset,
                          FileContent& content);

}  // namespace meshsmooth::formats

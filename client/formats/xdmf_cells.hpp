#pragma once

#include "cell_list.hpp"
#include "content.hpp"
#include "xdmf_data.hpp"

namespace meshsmooth::formats {

/// Adds the cells of a <Grid>'s <Topology>. Throws FORMAT_ERROR, ELEMENT_NOT_SUPPORTED.
void read_xdmf_cells(XdmfData& data, const std::filesystem::path& path, const XmlElement& grid,
                     CellList& cells);

/// A grid that tags cells and facets of the mesh, as dolfinx' MeshTags: each of its attributes
/// becomes sets of nodes, "NAME:VALUE", and a cell array where it tags cells of the mesh (0:
/// not tagged).
void read_xdmf_tags(XdmfData& data, const std::filesystem::path& path, const XmlElement& grid,
                    FileContent& content, PlainDataset& dataset);

}  // namespace meshsmooth::formats

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cell_list.hpp"
#include "content.hpp"
#include "xdmf/data.hpp"

namespace meshsmooth::formats {

/// The numbers of a <Topology> and what they mean.
struct XdmfTopology {
  std::string grid;  // its name, for messages
  std::string name;  // of its type, as the file has it
  std::string type;  // in lower case
  std::int64_t nodes_per_element = 0;
  std::int64_t first_node = 0;  // what the file calls the mesh's first
  std::int64_t expected = -1;   // elements; -1: any
  std::vector<std::int64_t> numbers;

  [[nodiscard]] bool operator==(const XdmfTopology& other) const {
    return type == other.type && nodes_per_element == other.nodes_per_element &&
           first_node == other.first_node && numbers == other.numbers;
  }
};

/// Throws FORMAT_ERROR, ELEMENT_NOT_SUPPORTED.
[[nodiscard]] XdmfTopology read_xdmf_topology(XdmfData& data, const std::filesystem::path& path,
                                              const XmlElement& topology, const std::string& grid);

/// The nodes of a <Geometry> among those of the mesh.
struct XdmfNodes {
  std::int64_t first = 0;
  std::int64_t count = 0;
};

/// Adds the cells of a topology. Throws FORMAT_ERROR, ELEMENT_NOT_SUPPORTED.
void read_xdmf_cells(const XdmfData& data, const std::filesystem::path& path,
                     const XdmfTopology& topology, const XdmfNodes& nodes, CellList& cells);

/// A grid that tags cells and facets of the mesh, as dolfinx' MeshTags: each of its attributes
/// becomes sets of nodes, "NAME:VALUE", and a cell array where it tags cells of the mesh (0:
/// not tagged).
void read_xdmf_tags(XdmfData& data, const XmlElement& grid, const PlainDataset& tagged,
                    FileContent& content, PlainDataset& dataset);

}  // namespace meshsmooth::formats

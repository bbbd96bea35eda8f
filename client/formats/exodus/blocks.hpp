#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "content.hpp"
#include "exodus/sides.hpp"
#include "foam_reader.hpp"
#include "netcdf_file.hpp"

namespace meshsmooth::formats {

/// The elements of a block, which count through all blocks.
struct ExodusBlock {
  std::int64_t id;
  std::string name;
  std::string type;                  // of its elements, "HEX8"
  std::optional<ExodusShape> shape;  // none: polygons, polyhedra, a type that only Exodus knows
  FoamFaces elements;                // their nodes, from 1, in Exodus' order
  FoamFaces faces;                   // those of each polyhedron, from 0, in `ExodusMesh::faces`
};

struct ExodusMesh {
  std::vector<ExodusBlock> blocks;
  FoamFaces faces;  // of polyhedra: their nodes, from 1
};

/// Whether its elements are polygons, "nsided" in any case.
[[nodiscard]] bool is_exodus_polygon(const ExodusBlock& block);

/// The ids of blocks or sets, which count from 1 where the file has none.
class ExodusIds {
 public:
  ExodusIds(const NetcdfFile& file, const std::string& variable) {
    if (file.has(variable)) ids_ = file.integers(variable);
  }
  [[nodiscard]] std::int64_t operator[](std::size_t index) const {
    return index < ids_.size() ? ids_[index] : static_cast<std::int64_t>(index) + 1;
  }

 private:
  std::vector<std::int64_t> ids_;
};

/// What `--fixed-set` calls the block or set: its name, or "nodeset_3" by its id.
[[nodiscard]] std::string exodus_name(const std::vector<std::string>& names, std::size_t index,
                                      const std::string& kind, std::int64_t id);

/// The blocks that have elements. Throws FORMAT_ERROR where they are not as many as the file says,
/// ELEMENT_NOT_SUPPORTED.
[[nodiscard]] ExodusMesh read_exodus_blocks(const NetcdfFile& file,
                                            const std::filesystem::path& path,
                                            std::size_t dimension);

void add_exodus_cells(const ExodusMesh& mesh, FileContent& content, PlainDataset& dataset);

}  // namespace meshsmooth::formats

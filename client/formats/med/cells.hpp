#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cell_list.hpp"
#include "content.hpp"
#include "hdf5_file.hpp"

namespace meshsmooth::formats {

/// The groups of each family, by its number.
using MedFamilies = std::map<std::int64_t, std::vector<std::string>>;

/// One number each, or none: 0.
[[nodiscard]] std::vector<std::int64_t> read_med_family_numbers(const Hdf5File& file,
                                                                const std::string& folder,
                                                                std::size_t count);

/// From 1, as MED counts, unless the file has numbers of its own and no two are the same.
[[nodiscard]] std::vector<std::int64_t> med_ids(std::vector<std::int64_t> numbers,
                                                std::size_t count);

/// The cells of a time step, type by type.
class MedCells {
 public:
  MedCells(const Hdf5File& file, const std::filesystem::path& path, FileContent& content)
      : file_(file), path_(path), content_(content) {}

  /// Throws ELEMENT_NOT_SUPPORTED, FORMAT_ERROR.
  void read(const std::string& step, const MedFamilies& families, PlainDataset& dataset);
  void store(PlainDataset& dataset);

 private:
  void read_type(const std::string& folder, const CellKind& kind);
  void read_polygons(const std::string& folder, int type);
  void read_polyhedra(const std::string& folder);
  void read_held(const std::string& folder, int type, std::size_t corners);
  [[nodiscard]] std::vector<std::int64_t> index(const std::string& name, std::size_t all) const;
  [[nodiscard]] std::vector<std::int64_t> axis_by_axis(const std::string& folder,
                                                       std::size_t corners) const;
  void read_families(const std::string& folder, int dimension, std::size_t count,
                     const MedFamilies& families);

  const Hdf5File& file_;
  const std::filesystem::path& path_;
  FileContent& content_;
  CellList cells_;
  Column column_ = {kFamilyArray, true, {}};
  std::vector<std::int64_t> ids_;
  std::map<std::pair<std::string, int>, std::set<int>> groups_;  // families by name, dimension
};

}  // namespace meshsmooth::formats

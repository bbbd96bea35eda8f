#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "cell_list.hpp"
#include "cgns/tree.hpp"
#include "content.hpp"
#include "foam_reader.hpp"

namespace meshsmooth::formats {

/// A zone of a CGNS file. Its nodes and elements are numbered from 1.
struct CgnsZone {
  std::string node;                // its path
  std::vector<std::int64_t> size;  // nodes, elements, boundary nodes
  std::int64_t first_node = 0;     // of the mesh
  std::int64_t id_offset = 0;      // to the element numbers, which the mesh has of all zones
};

/// Some of the elements, which are numbered through all sections of a zone.
struct CgnsSection {
  std::string name;
  std::string node;
  std::int64_t type;
  std::int64_t first;
  std::int64_t last;

  [[nodiscard]] std::int64_t size() const { return last - first + 1; }
};

/// The elements of the zones: cells, and the faces of polyhedra.
class CgnsElements {
 public:
  CgnsElements(const CgnsTree& tree, std::filesystem::path path);

  /// Adds the elements of a zone. Throws ELEMENT_NOT_SUPPORTED, FORMAT_ERROR.
  void read(const CgnsZone& zone, FileContent& content);
  /// Of the zones so far.
  [[nodiscard]] std::int64_t highest_id() const { return highest_id_; }
  /// Into the data set, which has its positions. To be called once, after all zones.
  void store(PlainDataset& dataset, FileContent& content);
  /// An element or face, by its number in the zone, which must exist.
  [[nodiscard]] Cell find(const std::string& node, const CgnsZone& zone, std::int64_t id,
                          const FileContent& content, const PlainDataset& dataset) const;

 private:
  [[nodiscard]] std::vector<CgnsSection> find_sections(const CgnsZone& zone) const;
  void read_section(const CgnsZone& zone, const CgnsSection& section, FileContent& content);
  void read_polygons(const CgnsSection& section, const FoamFaces& polygons);
  void read_polyhedra(const CgnsZone& zone, const CgnsSection& section);
  void add_cell(std::int64_t type, const CgnsSection& section, std::span<const std::int64_t> nodes);
  [[nodiscard]] FoamFaces rows_of(const CgnsSection& section) const;
  void add_faces(const CgnsZone& zone, const CgnsSection& section);
  void check_nodes(const CgnsZone& zone, const CgnsSection& section,
                   std::span<const std::int64_t> nodes) const;
  [[nodiscard]] std::int64_t find_face(std::int64_t id) const;
  [[noreturn]] void refuse_size(const CgnsSection& section) const;

  /// Faces of one section.
  struct FaceRange {
    std::int64_t first;  // their numbers, of all zones
    std::int64_t last;
    std::int64_t place;  // of the first in `faces_`
  };

  const CgnsTree& tree_;
  std::filesystem::path path_;
  bool before_version_3_ = false;  // when polygons had other numbers
  CellList cells_;
  std::vector<int> dimensions_;  // by cell
  FoamFaces faces_;              // nodes of the mesh, from 0
  std::vector<FaceRange> face_ranges_;
  Column section_column_ = {kSectionArray, true, {}};
  Column zone_column_ = {kZoneArray, true, {}};
  int section_number_ = 0;
  int zone_number_ = 0;
  std::int64_t highest_id_ = 0;
  std::int64_t first_node_ = 1;  // what is taken off the file's nodes of this zone
};

}  // namespace meshsmooth::formats

#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coordinate_arrays.hpp"
#include "coordinate_fields.hpp"
#include "dataset.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/options.hpp"

namespace meshsmooth::formats {

/// Names of the data arrays that carry what VTK has no place for. The first
/// three are meshio's.
inline constexpr const char* kPhysicalArray = "gmsh:physical";
inline constexpr const char* kEntityArray = "gmsh:geometrical";
inline constexpr const char* kReferenceArray = "medit:ref";
inline constexpr const char* kPhysicalNamesArray = "gmsh:physical_names";  // "DIM TAG NAME"
inline constexpr const char* kNodeIdArray = "node_id";
inline constexpr const char* kElementIdArray = "element_id";
inline constexpr const char* kMaterialArray = "abaqus:material";
inline constexpr const char* kNastranMaterialArray = "nastran:material";
inline constexpr const char* kCellZoneArray = "foam:cell_zone";
inline constexpr const char* kPatchArray = "foam:patch";
inline constexpr const char* kSu2MarkerArray = "su2:marker";
inline constexpr const char* kSu2ZoneArray = "su2:zone";  // its place in the file, from 1
inline constexpr const char* kMarkerArray = "tetgen:marker";
inline constexpr const char* kFamilyArray = "med:family";
inline constexpr const char* kBlockArray = "exodus:block";    // the block's id
inline constexpr const char* kSectionArray = "cgns:section";  // its place in the file, from 1
inline constexpr const char* kZoneArray = "cgns:zone";        // the same; of files with several
inline constexpr const char* kGridArray = "xdmf:grid";        // the same
inline constexpr const char* kAttributeArray = "tetgen:attribute_";  // and its number, from 0

class CoordinateSystems;

/// A physical group of Gmsh's: the cells of a dimension that have one of some values in an array.
struct CellGroup {
  int dimension;
  std::string name;  // its number where it has none
  const char* array;
  std::vector<int> values;
};

/// A physical group of Gmsh's, as `kPhysicalNamesArray` has it.
struct PhysicalName {
  int dimension = 0;
  int tag = 0;
  std::string name;  // or empty

  [[nodiscard]] std::string called() const { return name.empty() ? std::to_string(tag) : name; }
};

/// Sides of elements, or cells of a lower dimension, one after the other.
class Facets {
 public:
  struct Facet {
    std::span<const NodeId> nodes;  // the corners first
    std::size_t corner_count;       // 1: a point, 2: an edge, else a face; 0: nodes of several
  };

  /// `nodes` of any integer type, the corners first; all must exist.
  template <class Nodes>
  void add(const Nodes& nodes, std::size_t corner_count) {
    for (const auto node : nodes) nodes_.push_back(static_cast<NodeId>(node));
    rows_.push_back({nodes_.size(), corner_count});
  }
  /// A cell; none is added of a type that cannot be a side of an element.
  void add(const Cell& cell);
  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] Facet operator[](std::size_t row) const {
    const std::size_t first = row == 0 ? 0 : rows_[row - 1].end;
    return {std::span(nodes_).subspan(first, rows_[row].end - first), rows_[row].corner_count};
  }

 private:
  struct Row {
    std::size_t end;  // in `nodes_`
    std::size_t corner_count;
  };
  std::vector<NodeId> nodes_;
  std::vector<Row> rows_;
};

/// Nodes that a file names: a node set, a boundary patch, a marker.
struct NodeSet {
  std::string name;
  std::vector<NodeId> nodes;  // in any order, repeated or not
  Facets facets = {};         // what surfaces and lines of the set are made of, as far as is known
};

/// A part of the text of a deck or case that may be spread over several files.
struct TextSegment {
  std::size_t file;  // in `FileContent::files`
  bool directive;    // only tells that another file belongs here
  std::string text;
  CoordinateFields fields;
  std::vector<NodeId> nodes;  // of the mesh, one for each of `fields`
};

/// All that a file carries. Every reader fills the data set, which is what the
/// formats exchange when one is converted to another; readers of text formats
/// also keep the text, to write the same format by changing only the
/// coordinates in it.
class FileContent {
 public:
  std::string extension;                   // of the format read, ".vtu"
  std::shared_ptr<const Dataset> dataset;  // all cells in the file's order
  std::vector<std::int64_t> node_ids;      // empty: they count from 0
  std::vector<std::int64_t> cell_ids;      // empty: they count from 0
  std::vector<CellGroup> groups;
  std::vector<PhysicalName> physical_names;  // for VTK; empty where the data set has them itself
  std::vector<NodeSet> node_sets;
  std::vector<NodeId> fixed_nodes;  // that the file says must stay; in any order
  // That have to match: periodic, by an equation, between zones. Twice the same node has to match
  // one that is not known. In any order, repeated or not; sorted, each once, in a `MeshFile`.
  std::vector<NodePair> node_pairs;
  // By cell, which groups it is in: 0 in none, else a number for each set of groups; or empty.
  std::vector<std::int32_t> group_sets;
  std::vector<std::int64_t> element_cells;  // the cells of the mesh's elements
  std::vector<NodeId> nodes_by_id;          // nodes in ascending order of their ids; or empty
  std::vector<NodeId> lower_dimensional_nodes;
  std::int64_t lower_dimensional_cell_count = 0;
  std::vector<HeldCells> held_cells;
  std::string text;         // the file, or empty
  CoordinateFields fields;  // in the text; one per node
  // In an HDF5, netCDF or ADF file: of all nodes; several may hold the same nodes.
  std::vector<CoordinateArrays> arrays;
  std::string companion_text;  // of the .ele file beside a .node file, of an .xdmf file's .h5 file
  std::filesystem::path companion;  // its name as the text has it, or empty
  std::filesystem::path folder;     // from which the text names other files; or empty
  // Where the text may be spread: its files, the main one first, and its parts as they are read.
  std::vector<std::filesystem::path> files;
  std::vector<TextSegment> segments;
  std::vector<std::string> notes;  // what was tolerated, a line each
  // Of a Nastran deck in which nodes are defined in systems of their own: in its text stand these
  // coordinates; or null.
  std::shared_ptr<const CoordinateSystems> systems;
};

/// Sorts the cells of `content.dataset` into mesh and lower-dimensional cells. Throws
/// MESH_EMPTY, ELEMENT_NOT_SUPPORTED, FORMAT_ERROR.
[[nodiscard]] MeshFile make_mesh_file(const std::filesystem::path& path, FileContent content);

/// Throws `InvalidMesh` (ARRAY_SIZE_MISMATCH) unless the mesh still has as many
/// nodes as its file.
void check_node_count(const MeshFile& file);

/// Throws ELEMENT_NOT_SUPPORTED where a mesh of another format has held cells of other types than
/// these, which the format written can carry.
void check_held_cells(const std::filesystem::path& path, const MeshFile& file,
                      std::initializer_list<int> carried);

/// A segment that is a whole file, whose nodes are all of the mesh in their order.
[[nodiscard]] TextSegment whole_file(std::string text, CoordinateFields fields);

/// The segment's text with the mesh's positions put in place; a zero keeps the sign that it had.
/// O(text).
[[nodiscard]] std::string replace_coordinates(const TextSegment& segment, const Mesh& mesh);

/// The data set of the mesh's file; of the mesh alone where it has no file. Its
/// positions are those that were read.
[[nodiscard]] std::shared_ptr<const Dataset> dataset_of(const MeshFile& file);

}  // namespace meshsmooth::formats

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "meshsmooth/error.hpp"
#include "meshsmooth/mesh.hpp"
#include "meshsmooth/options.hpp"
#include "meshsmooth/quality.hpp"

namespace meshsmooth::formats {

class FileContent;

/// A number for each element, to be written as a cell array.
struct ElementArray {
  std::string name;
  std::vector<float> values;  // by element; NaN: it has none
};

/// Cells that cannot be smoothed, of one type: polygons of five or more nodes, triangle strips,
/// polyhedra, elements that only their format knows.
struct HeldCells {
  int cell_type;     // VTK's number, or `PlainDataset::own_type`
  std::string name;  // "polyhedron", "COH3D8"
  std::int64_t count;
};

/// A mesh file in memory: the mesh to smooth, and whatever else the file
/// carries, kept so that writing gives back the caller's own file with only
/// the coordinates changed.
///
/// The mesh holds the elements of the file's highest dimension, one block per
/// type; the file's elements keep their order inside a block. Elements of a
/// lower dimension (points, edges, surface elements of a volume mesh) are
/// lower-dimensional cells: they are written again, following their nodes. Nodes are in the
/// file's order. Coordinates keep the file's precision.
///
/// Change `mesh.positions` and `mesh.fixed` as you like (also the precision);
/// the number of nodes and the blocks must stay as they were read. Copies are
/// cheap but for the mesh: the rest is shared and never changes.
class MeshFile {
 public:
  MeshFile() = default;
  /// A mesh that comes from no file; ids count from 0.
  explicit MeshFile(Mesh mesh_of_its_own) : mesh(std::move(mesh_of_its_own)) {}
  MeshFile(Mesh mesh_of_file, std::shared_ptr<const FileContent> content);

  Mesh mesh;
  /// Written as one cell array of float32 per metric, by the metric's name, instead of an array
  /// that the file may have of that name; NaN in lower-dimensional cells.
  ElementQualityArrays element_quality;
  /// Written in the same way.
  std::vector<ElementArray> element_arrays;

  /// What the file calls a mesh element: its tag (Gmsh), its number (TetGen)
  /// or its 0-based position among all elements (VTK). O(1).
  [[nodiscard]] std::int64_t file_element_id(std::int64_t element) const;
  /// What the file calls a node. O(1).
  [[nodiscard]] std::int64_t file_node_id(std::int64_t node) const;
  /// The node that the file calls so. O(log nodes).
  [[nodiscard]] std::optional<NodeId> find_node(std::int64_t file_id) const;

  /// The nodes of all lower-dimensional cells, each once, ascending.
  [[nodiscard]] const std::vector<NodeId>& lower_dimensional_nodes() const;
  [[nodiscard]] std::int64_t lower_dimensional_cell_count() const;
  /// The cells whose nodes `mesh.fixed` holds in place because they cannot be smoothed, by type.
  [[nodiscard]] const std::vector<HeldCells>& held_cells() const;
  /// Nodes that the file says belong together, for `JobInput::node_pairs`: periodic ones, of
  /// an equation, of zones that meet. A node that is its own partner has one that is not known.
  [[nodiscard]] const std::vector<NodePair>& node_pairs() const;
  /// What is wrong with the file but was read, as the programs do that it is for; one line each.
  [[nodiscard]] const std::vector<std::string>& notes() const;

  /// For the writers; null for a mesh that comes from no file.
  [[nodiscard]] const std::shared_ptr<const FileContent>& content() const { return content_; }

 private:
  std::shared_ptr<const FileContent> content_;
};

/// The format is the one called `format` ("inp", ".inp") or, where that is empty, follows from the
/// extension, in any letter case and before ".gz" (`kFormats`); a folder is OpenFOAM's. What gzip
/// compressed is decompressed, whatever its name. A pipe is read as a file is, "-" is standard
/// input.
///
/// Written to the format it was read from, a file changes in its coordinates alone. Writing to
/// another format converts what that format can carry: data arrays, ids, physical groups (VTK and
/// MSH both ways), lower-dimensional cells; an element type it cannot carry is an error. MED, CGNS,
/// Exodus and XDMF files are written from files of the same format only. Not thread-safe: the Gmsh
/// and HDF5 libraries have one global state.
///
/// A wedge's first triangle looks outward, as VTK's documentation says and
/// Gmsh's and OpenFOAM's VTK files have it.
///
/// Errors: FILE_NOT_FOUND, FILE_NOT_READABLE, FORMAT_UNKNOWN (also: built
/// without the library), FORMAT_ERROR, FILE_TRUNCATED, MESH_EMPTY (nothing to
/// smooth in it), ELEMENT_NOT_SUPPORTED (higher order, polyhedra …).
/// O(file size).
[[nodiscard]] MeshFile read_mesh_file(const std::filesystem::path& path,
                                      const std::string& format = {});

/// Replaces `path` when all has been written, never before. A symbolic link stays and leads to the
/// new file, which has the permissions of the one that it replaces. A name in ".gz" compresses. A
/// pipe or device gets all bytes at last, also standard output, which is called "-"; its format is
/// that of the file read where neither `format` nor its name tells one. Errors:
/// FORMAT_UNKNOWN, FILE_NOT_WRITABLE, ELEMENT_NOT_SUPPORTED, ARRAYS_NOT_SUPPORTED; `InvalidMesh`
/// (ARRAY_SIZE_MISMATCH) when the mesh has not the nodes of its file.
void write_mesh_file(const std::filesystem::path& path, const MeshFile& file,
                     const std::string& format = {});

/// Throws what `write_mesh_file` would throw for this path as far as it can be
/// foreseen (format, folder, permission), before the work starts. `source` is the file that was or
/// will be read, or its extension; empty: there is none. Leaves no file behind.
void check_writable(const std::filesystem::path& path, const std::filesystem::path& source = {},
                    const std::string& format = {});

/// The same for files with `MeshFile::element_quality` or `element_arrays`; also
/// ARRAYS_NOT_SUPPORTED.
void check_writable_with_arrays(const std::filesystem::path& path,
                                const std::filesystem::path& source = {},
                                const std::string& format = {});

/// The extension by which `kFormats` knows the format of a file or, where it is not empty, the one
/// called `format`: ".inp" of "part.INP.gz"; empty: unknown.
[[nodiscard]] std::string find_format_name(const std::filesystem::path& path,
                                           const std::string& format = {});

/// ".vtu .vtk …": what can be read and written here, and written with cell arrays, for messages and
/// help.
[[nodiscard]] std::string readable_extensions();
[[nodiscard]] std::string writable_extensions();
[[nodiscard]] std::string array_extensions();

}  // namespace meshsmooth::formats

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

// Cell types by VTK's numbers, which stand for them all through the formats.
inline constexpr int kVertexCell = 1;
inline constexpr int kPolyVertexCell = 2;
inline constexpr int kLineCell = 3;
inline constexpr int kPolyLineCell = 4;
inline constexpr int kTriangleCell = 5;
inline constexpr int kTriangleStripCell = 6;
inline constexpr int kPolygonCell = 7;
inline constexpr int kQuadCell = 9;
inline constexpr int kTetrahedronCell = 10;
inline constexpr int kHexahedronCell = 12;
inline constexpr int kWedgeCell = 13;
inline constexpr int kPyramidCell = 14;
inline constexpr int kEdge3Cell = 21;  // these of second order
inline constexpr int kTriangle6Cell = 22;
inline constexpr int kQuad8Cell = 23;
inline constexpr int kTetrahedron10Cell = 24;
inline constexpr int kHexahedron20Cell = 25;
inline constexpr int kWedge15Cell = 26;
inline constexpr int kPyramid13Cell = 27;
inline constexpr int kQuad9Cell = 28;
inline constexpr int kHexahedron27Cell = 29;
inline constexpr int kWedge18Cell = 32;
inline constexpr int kPolyhedronCell = 42;  // its nodes, each once: none here needs its faces
/// From here on: types that only the file's own format knows (`PlainDataset::own_type`). Such a
/// cell keeps its nodes where they are.
inline constexpr int kFirstOwnCellType = 1000;

struct Cell {
  int type = 0;
  std::vector<std::int64_t> nodes;  // as the file has them; they need not exist
};

/// One number per node or cell.
struct Column {
  std::string name;
  bool whole;  // integers
  std::vector<double> values;
};

/// Several numbers per node or cell, one after the other.
struct Table {
  std::string name;
  std::size_t components;
  std::vector<double> values;
};

/// Any array of a file, for comparisons.
struct StoredArray {
  std::string name;   // with its place: "point array pressure"
  std::string type;   // "float64 x 3", "string"; equal names and types have comparable contents
  std::string bytes;  // its contents
};

using Positions = decltype(Mesh::positions);

/// All nodes and cells of a file in its own order, with their attributes, in
/// whatever form its reader has them.
class Dataset {
 public:
  virtual ~Dataset() = default;
  [[nodiscard]] virtual std::int64_t node_count() const = 0;
  [[nodiscard]] virtual std::int64_t cell_count() const = 0;
  /// Into `cell`, so that its memory serves again.
  virtual void get_cell(std::int64_t id, Cell& cell) const = 0;
  [[nodiscard]] virtual Positions positions() const = 0;
  [[nodiscard]] virtual std::vector<Column> node_columns() const = 0;
  [[nodiscard]] virtual std::vector<Column> cell_columns() const = 0;
  /// One by its name, without copying the others; none: there is no such column.
  [[nodiscard]] virtual std::optional<Column> node_column(const std::string& name) const = 0;
  [[nodiscard]] virtual std::optional<Column> cell_column(const std::string& name) const = 0;
  /// One of three numbers a node, by its name; none: there is no such array.
  [[nodiscard]] virtual std::optional<std::vector<Vec3d>> node_vectors(const std::string&) const {
    return std::nullopt;
  }
  /// What hangs on nodes and cells with several numbers each, where no library holds it.
  [[nodiscard]] virtual std::span<const Table> node_tables() const { return {}; }
  [[nodiscard]] virtual std::span<const Table> cell_tables() const { return {}; }
  /// All that hangs on the nodes, the cells and the whole, but positions and cells; by default the
  /// columns and tables.
  [[nodiscard]] virtual std::vector<StoredArray> stored_arrays() const;
  /// "quadratic tetrahedron (VTK cell type 24)".
  [[nodiscard]] virtual std::string cell_name(int type) const = 0;
  /// Of an own type; 0: it does not decide the dimension of the mesh.
  [[nodiscard]] virtual int own_dimension(int) const { return 0; }
};

/// Filled by the readers without third-party libraries.
class PlainDataset final : public Dataset {
 public:
  PlainDataset() = default;
  /// The mesh's nodes and elements, nothing else.
  explicit PlainDataset(const Mesh& mesh);

  void add_cell(int type, std::span<const std::int64_t> nodes);
  /// The cell type of elements that the format calls `name` ("COH3D8") and that cannot be smoothed;
  /// the same for the same name. `dimension` 0: such elements do not decide that of the mesh.
  /// O(names so far).
  [[nodiscard]] int own_type(std::string_view name, int dimension = 0);
  void set_positions(Positions positions) { positions_ = std::move(positions); }
  void add_node_column(Column column) { node_columns_.push_back(std::move(column)); }
  void add_cell_column(Column column) { cell_columns_.push_back(std::move(column)); }
  void add_node_table(Table table) { node_tables_.push_back(std::move(table)); }
  void add_cell_table(Table table) { cell_tables_.push_back(std::move(table)); }

  [[nodiscard]] std::int64_t node_count() const override;
  [[nodiscard]] std::int64_t cell_count() const override;
  void get_cell(std::int64_t id, Cell& cell) const override;
  [[nodiscard]] Positions positions() const override { return positions_; }
  [[nodiscard]] std::vector<Column> node_columns() const override { return node_columns_; }
  [[nodiscard]] std::vector<Column> cell_columns() const override { return cell_columns_; }
  [[nodiscard]] std::optional<Column> node_column(const std::string& name) const override;
  [[nodiscard]] std::optional<Column> cell_column(const std::string& name) const override;
  [[nodiscard]] std::optional<std::vector<Vec3d>> node_vectors(
      const std::string& name) const override;
  [[nodiscard]] std::span<const Table> node_tables() const override { return node_tables_; }
  [[nodiscard]] std::span<const Table> cell_tables() const override { return cell_tables_; }
  [[nodiscard]] std::string cell_name(int type) const override;
  [[nodiscard]] int own_dimension(int type) const override;

 private:
  struct OwnType {
    std::string name;
    int dimension;
  };

  Positions positions_;
  std::vector<int> types_;
  std::vector<OwnType> own_types_;
  std::vector<std::size_t> first_ = {0};  // of each cell in `nodes_`, and the end
  std::vector<std::int64_t> nodes_;
  std::vector<Column> node_columns_;
  std::vector<Column> cell_columns_;
  std::vector<Table> node_tables_;
  std::vector<Table> cell_tables_;
};

}  // namespace meshsmooth::formats

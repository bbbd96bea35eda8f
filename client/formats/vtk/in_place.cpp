#include "vtk/in_place.hpp"

#include <algorithm>
#include <utility>

#include "vtk/number_text.hpp"
#include "vtk/voxels.hpp"

namespace meshsmooth::formats {
namespace {

/// Where the nodes of each cell of a piece begin in its connectivity, and how many there are.
struct CellRange {
  std::size_t begin;
  std::size_t count;
};

/// None: the numbers are not a list of cells.
std::optional<std::vector<CellRange>> cell_ranges(std::string_view file, const VtkPiece& piece,
                                                  std::size_t connectivity_size,
                                                  std::span<const double> connectivity) {
  std::vector<CellRange> ranges;
  std::size_t begin = 0;
  const auto add = [&](double end_or_count, bool is_end) {
    if (!(end_or_count >= 0) || end_or_count > static_cast<double>(connectivity_size)) return false;
    const auto number = static_cast<std::size_t>(end_or_count);
    if (is_end && number < begin) return false;
    ranges.push_back({begin, is_end ? number - begin : number});
    begin += ranges.back().count;
    return begin <= connectivity_size;
  };
  if (!piece.offsets) {
    for (std::size_t cell = 0; cell < piece.cell_count; ++cell) {
      if (begin >= connectivity_size || !add(connectivity[begin++], false)) return std::nullopt;
    }
    return ranges;
  }
  const auto offsets = read_numbers(file, *piece.offsets);
  if (!offsets || offsets->size() < piece.cell_count) return std::nullopt;
  // Legacy files have also the offset of the first cell, 0.
  const std::size_t first = offsets->size() - piece.cell_count;
  for (std::size_t cell = 0; cell < piece.cell_count; ++cell) {
    if (!add((*offsets)[first + cell], true)) return std::nullopt;
  }
  return ranges;
}

/// The lists of a piece's cells, as they stand in the file.
struct Cells {
  std::vector<double> connectivity;
  std::vector<double> types;
  std::vector<CellRange> ranges;
};

std::optional<Cells> read_cells(std::string_view file, const VtkPiece& piece) {
  if (!piece.connectivity || !piece.types) return std::nullopt;
  auto connectivity = read_numbers(file, *piece.connectivity);
  auto types = read_numbers(file, *piece.types);
  if (!connectivity || !types || types->size() != piece.cell_count) return std::nullopt;
  auto ranges = cell_ranges(file, piece, connectivity->size(), *connectivity);
  if (!ranges) return std::nullopt;
  return Cells{std::move(*connectivity), std::move(*types), std::move(*ranges)};
}

bool agrees_on_cells(std::string_view file, const VtkLayout& layout, const VtkDataset& dataset) {
  vtkIdType first = 0;
  Cell read;
  for (const VtkPiece& piece : layout.pieces) {
    if (piece.cell_count == 0) continue;
    const auto cells = read_cells(file, piece);
    if (!cells) return false;
    for (std::size_t cell = 0; cell < piece.cell_count; ++cell, ++first) {
      if (first >= dataset.data()->GetNumberOfCells()) return false;
      const int type = dataset.data()->GetCellType(first);
      if (cells->types[cell] != type) return false;
      if (type != kPixelCell && type != kVoxelCell) continue;
      dataset.get_cell(first, read);
      if (cells->ranges[cell].count != read.nodes.size()) return false;
    }
  }
  return first == dataset.data()->GetNumberOfCells();
}

std::vector<double> coordinates(const PositionsView& positions, std::size_t first,
                                std::size_t count) {
  std::vector<double> numbers;
  numbers.reserve(3 * count);
  std::visit(
      [&](const auto& nodes) {
        for (const auto& node : nodes.subspan(first, count)) {
          numbers.insert(numbers.end(), {double(node.x), double(node.y), double(node.z)});
        }
      },
      positions);
  return numbers;
}

void add_points(std::string_view file, const VtkPiece& piece, std::span<const double> numbers,
                const NumberType& type, bool precision_changed, std::vector<Edit>& edits) {
  const auto before = read_numbers(file, piece.points);
  const bool same = before && std::ranges::equal(*before, numbers, same_number);
  if (same && !(precision_changed && piece.points.type != type)) return;
  std::ranges::move(replace_numbers(file, piece.points, numbers, type), std::back_inserter(edits));
  if (piece.points.type == type) return;
  const std::string_view name = file.substr(piece.points_type.begin, piece.points_type.length);
  const bool xml = xml_number_type(name).has_value();
  const bool single = type == kFloat32;
  edits.push_back({piece.points_type.begin, piece.points_type.length,
                   xml ? (single ? "Float32" : "Float64") : (single ? "float" : "double")});
}

void add_turned_voxels(std::string_view file, const VtkLayout& layout,
                       std::span<const std::int64_t> turned, std::vector<Edit>& edits) {
  std::size_t first = 0;
  for (const VtkPiece& piece : layout.pieces) {
    const std::size_t end = first + piece.cell_count;
    const auto own = turned.subspan(
        0, static_cast<std::size_t>(
               std::ranges::lower_bound(turned, static_cast<std::int64_t>(end)) - turned.begin()));
    turned = turned.subspan(own.size());
    if (!own.empty()) {
      auto cells = read_cells(file, piece);
      for (const std::int64_t id : own) {
        const std::size_t cell = static_cast<std::size_t>(id) - first;
        const CellRange range = cells->ranges[cell];
        cells->types[cell] =
            turn_voxel(std::span(cells->connectivity).subspan(range.begin, range.count));
      }
      const auto replace = [&](const NumberBlock& block, std::span<const double> numbers) {
        std::ranges::move(replace_numbers(file, block, numbers, block.type),
                          std::back_inserter(edits));
      };
      replace(*piece.connectivity, cells->connectivity);
      replace(*piece.types, cells->types);
    }
    first = end;
  }
}

/// Appended arrays that begin behind one that has become longer or shorter.
void add_offsets(const VtkLayout& layout, std::vector<Edit>& edits) {
  const std::size_t count = edits.size();
  for (const AppendedOffset& offset : layout.offsets) {
    std::size_t value = offset.value;
    for (std::size_t edit = 0; edit < count; ++edit) {
      const bool before = edits[edit].begin >= layout.appended_begin &&
                          edits[edit].begin - layout.appended_begin < offset.value;
      if (layout.appended && before) value += edits[edit].bytes.size() - edits[edit].length;
    }
    if (value == offset.value) continue;
    edits.push_back({offset.text.begin, offset.text.length, std::to_string(value)});
  }
}

}  // namespace

bool agrees(std::string_view file, const VtkLayout& layout, const VtkDataset& dataset) {
  vtkPoints* const points = dataset.data()->GetPoints();
  vtkIdType node = 0;
  for (const VtkPiece& piece : layout.pieces) {
    if (piece.node_count == 0) continue;
    const auto numbers = read_numbers(file, piece.points);
    if (!numbers || points == nullptr || numbers->size() != 3 * piece.node_count) return false;
    for (std::size_t place = 0; place < numbers->size(); place += 3, ++node) {
      if (node >= points->GetNumberOfPoints()) return false;
      const double* const read = points->GetPoint(node);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!same_number((*numbers)[place + axis], read[axis])) return false;
      }
    }
  }
  if (node != dataset.node_count()) return false;
  return !dataset.has_voxels() || agrees_on_cells(file, layout, dataset);
}

std::string moved_file(std::string_view file, const VtkDataset& dataset, const Mesh& mesh) {
  const VtkLayout& layout = *dataset.layout();
  const PositionsView positions = mesh.positions_view();
  const bool single = std::holds_alternative<std::span<const Vec3f>>(positions);
  const bool was_single = dataset.data()->GetPoints()->GetDataType() == VTK_FLOAT;
  std::vector<Edit> edits;
  std::size_t first = 0;
  for (const VtkPiece& piece : layout.pieces) {
    add_points(file, piece, coordinates(positions, first, piece.node_count),
               single ? kFloat32 : kFloat64, single != was_single, edits);
    first += piece.node_count;
  }
  add_turned_voxels(file, layout, voxels_to_turn(dataset, mesh), edits);
  add_offsets(layout, edits);
  return apply_edits(file, edits);
}

}  // namespace meshsmooth::formats

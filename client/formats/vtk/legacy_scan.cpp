#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "text.hpp"
#include "vtk/layout.hpp"
#include "vtk/legacy_arrays.hpp"

namespace meshsmooth::formats {
namespace {

using Kind = NumberType::Kind;

/// Walks over a whole legacy file as VTK's reader does, which does not say where it fails, trusts
/// the sizes that it finds and does not know NaN.
class LegacyScan {
 public:
  LegacyScan(const std::filesystem::path& path, std::string_view file)
      : path_(path), file_(file), scanner_(path, file), arrays_(path, file, scanner_) {}

  VtkLayout scan() {
    read_header();
    layout_.pieces.emplace_back();
    bool attributes = false;  // which come last
    std::size_t count = 0;
    while (!scanner_.at_end()) {
      const std::string_view word = scanner_.token();
      const std::string keyword = lower_case(word);
      if (keyword == "point_data" || keyword == "cell_data") {
        attributes = true;
        count = read_attribute_count(keyword == "point_data");
      } else if (keyword == "field") {
        read_fields();
      } else if (attributes ? !read_attribute(keyword, count) : !read_geometry(keyword)) {
        scanner_.refuse(attributes ? "the keyword of a data array" : "a keyword of legacy VTK",
                        word);
      }
    }
    finish();
    return std::move(layout_);
  }

 private:
  void read_header() {
    constexpr std::string_view kSignature = "# vtk DataFile Version";
    const std::string_view first = scanner_.line();
    if (!first.starts_with(kSignature)) fail("FORMAT_ERROR", path_, "this is no legacy VTK file");
    const std::string_view version = trimmed(first.substr(kSignature.size()));
    layout_.major_version = version.empty() || version[0] < '0' ? 0 : version[0] - '0';
    layout_.version = first;
    layout_.title = scanner_.line();
    const std::string_view encoding = scanner_.token();
    layout_.binary = lower_case(encoding).starts_with("binary");
    if (!layout_.binary && !lower_case(encoding).starts_with("ascii")) {
      scanner_.refuse("ASCII or BINARY", encoding);
    }
    arrays_.set_binary(layout_.binary);
    if (const auto word = scanner_.token(); lower_case(word) != "dataset") {
      scanner_.refuse("DATASET", word);
    }
    layout_.type_name = scanner_.token();
    const std::string type = lower_case(layout_.type_name);
    poly_data_ = type == "polydata";
    if (poly_data_ || type == "unstructured_grid") return;
    fail("ELEMENT_NOT_SUPPORTED", path_,
         "it holds a " + layout_.type_name +
             "; only UNSTRUCTURED_GRID and POLYDATA can be smoothed: convert it to an unstructured "
             "grid (in pyvista by cast_to_unstructured_grid(), in ParaView by the filter Append "
             "Datasets)");
  }

  std::size_t read_attribute_count(bool of_points) {
    const VtkPiece& piece = layout_.pieces[0];
    const std::size_t count = scanner_.count();
    const std::size_t expected = of_points ? piece.node_count : piece.cell_count;
    if (count != expected) {
      fail("FORMAT_ERROR", path_,
           std::string(of_points ? "POINT_DATA" : "CELL_DATA") + " is for " +
               std::to_string(count) + ", there are " + std::to_string(expected) +
               (of_points ? " points" : " cells"));
    }
    return count;
  }

  bool read_geometry(const std::string& keyword) {
    VtkPiece& piece = layout_.pieces[0];
    if (keyword == "points") {
      if (std::exchange(has_points_, true)) scanner_.refuse("one list of POINTS", keyword);
      piece.node_count = scanner_.count();
      const std::string_view type = scanner_.token();
      piece.points_type = {scanner_.offset_of(type), type.size()};
      piece.points = arrays_.read_array(type, piece.node_count, 3);
      return true;
    }
    if (!poly_data_ && keyword == "cells") {
      if (piece.connectivity) scanner_.refuse("one list of CELLS", keyword);
      piece.cell_count = read_cells(keyword, piece.connectivity, piece.offsets);
      return true;
    }
    if (!poly_data_ && keyword == "cell_types") {
      const std::size_t count = scanner_.count();
      piece.types = arrays_.read_numbers_of({Kind::integer, 4}, count);
      return true;
    }
    static constexpr auto kLists =
        std::to_array<std::string_view>({"vertices", "lines", "polygons", "triangle_strips"});
    if (!poly_data_ || std::ranges::find(kLists, keyword) == kLists.end()) return false;
    if (std::ranges::find(lists_, keyword) != lists_.end()) {
      scanner_.refuse("one list of these", keyword);
    }
    lists_.push_back(keyword);
    std::optional<NumberBlock> connectivity, offsets;
    piece.cell_count += read_cells(keyword, connectivity, offsets);
    return true;
  }

  /// Returns how many. Up to version 4, rows of nodes, each with their number before it; from 5 on
  /// the nodes of all, and where those of each begin.
  std::size_t read_cells(const std::string& keyword, std::optional<NumberBlock>& connectivity,
                         std::optional<NumberBlock>& offsets) {
    const std::size_t count = scanner_.count();
    const std::size_t size = scanner_.count();
    if (layout_.major_version >= 5) {
      if (count == 0) return 0;
      offsets = read_named_array("offsets", count);
      connectivity = read_named_array("connectivity", size);
      check_offsets(keyword, *offsets, size);
      return count - 1;
    }
    connectivity = arrays_.read_numbers_of({Kind::integer, 4}, size);
    const auto numbers = numbers_of(*connectivity);
    std::size_t place = 0;
    for (std::size_t cell = 0; cell < count; ++cell) {
      const double width = place < size ? numbers[place] : -1;
      if (!(width >= 0) || width >= static_cast<double>(size - place)) {
        fail("FORMAT_ERROR", path_,
             lower_case(keyword) + ": cell " + std::to_string(cell) + " of " +
                 std::to_string(count) + " goes beyond the " + std::to_string(size) +
                 " numbers of the list");
      }
      place += static_cast<std::size_t>(width) + 1;
    }
    if (place != size) {
      fail("FORMAT_ERROR", path_,
           lower_case(keyword) + ": " + std::to_string(size) + " numbers are announced, but the " +
               std::to_string(count) + " cells have " + std::to_string(place));
    }
    return count;
  }

  void check_offsets(const std::string& keyword, const NumberBlock& block, std::size_t size) {
    double last = 0;
    for (const double offset : numbers_of(block)) {
      if (!(offset >= last)) fail("FORMAT_ERROR", path_, keyword + ": its offsets descend");
      last = offset;
    }
    if (last == static_cast<double>(size)) return;
    fail("FORMAT_ERROR", path_,
         keyword + ": the last offset is not the " + std::to_string(size) + " of its nodes");
  }

  std::vector<double> numbers_of(const NumberBlock& block) const {
    auto numbers = read_numbers(file_, block);
    if (!numbers) fail("FORMAT_ERROR", path_, "its lists of cells are damaged");
    return std::move(*numbers);
  }

  NumberBlock read_named_array(std::string_view name, std::size_t count) {
    if (const auto word = scanner_.token(); lower_case(word) != name) scanner_.refuse(name, word);
    return arrays_.read_array(scanner_.token(), count, 1);
  }

  bool read_attribute(const std::string& keyword, std::size_t count) {
    if (keyword == "lookup_table") {
      scanner_.token();
      const std::size_t size = scanner_.count();
      arrays_.read_colours(4, size);
      return true;
    }
    static const std::map<std::string_view, std::size_t> widths = {
        {"scalars", 1},      {"vectors", 3},    {"normals", 3},
        {"tensors", 9},      {"tensors6", 6},   {"global_ids", 1},
        {"pedigree_ids", 1}, {"edge_flags", 1}, {"texture_coordinates", 0},
        {"color_scalars", 0}};
    const auto found = widths.find(keyword);
    if (found == widths.end()) return false;
    scanner_.token();  // the array's name
    std::size_t width = found->second;
    if (width == 0) width = scanner_.count();
    if (keyword == "color_scalars") {
      arrays_.read_colours(width, count);
      return true;
    }
    const std::string_view type = scanner_.token();
    if (keyword == "scalars") {
      auto word = scanner_.token();
      if (lower_case(word) != "lookup_table") {
        width = scanner_.parse<std::uint16_t>(word);
        word = scanner_.token();
      }
      if (lower_case(word) != "lookup_table") scanner_.refuse("LOOKUP_TABLE", word);
      scanner_.token();
    }
    (void)arrays_.read_array(type, count, width);
    return true;
  }

  void read_fields() {
    scanner_.token();  // the field's name
    const std::size_t count = scanner_.count();
    for (std::size_t array = 0; array < count; ++array) {
      if (scanner_.token() == "NULL_ARRAY") continue;
      const std::size_t width = scanner_.count();
      const std::size_t rows = scanner_.count();
      (void)arrays_.read_array(scanner_.token(), rows, width);
    }
  }

  void finish() {
    VtkPiece& piece = layout_.pieces[0];
    if (!has_points_) fail("MESH_EMPTY", path_, "there are no POINTS in it");
    const std::size_t types = piece.types ? piece.types->count : 0;
    if (!poly_data_ && types != piece.cell_count) {
      fail("FORMAT_ERROR", path_,
           "there are " + std::to_string(piece.cell_count) + " CELLS and " + std::to_string(types) +
               " CELL_TYPES");
    }
    if (auto& replaced = arrays_.replaced(); !replaced.empty()) {
      layout_.readable = apply_edits(file_, replaced);
    }
  }

  const std::filesystem::path& path_;
  std::string_view file_;
  Scanner scanner_;
  LegacyArrays arrays_;
  VtkLayout layout_;
  bool poly_data_ = false;
  bool has_points_ = false;
  std::vector<std::string> lists_;  // of a POLYDATA that were there
};

}  // namespace

std::size_t VtkLayout::node_count() const {
  std::size_t count = 0;
  for (const VtkPiece& piece : pieces) count += piece.node_count;
  return count;
}

std::size_t VtkLayout::cell_count() const {
  std::size_t count = 0;
  for (const VtkPiece& piece : pieces) count += piece.cell_count;
  return count;
}

VtkLayout scan_legacy(const std::filesystem::path& path, std::string_view file) {
  return LegacyScan(path, file).scan();
}

}  // namespace meshsmooth::formats

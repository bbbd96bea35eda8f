#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vtk/number_block.hpp"

namespace meshsmooth::formats {

/// Something in the bytes of a file.
struct TextRange {
  std::size_t begin = 0;
  std::size_t length = 0;
};

/// Where one piece of a VTK file has its numbers.
struct VtkPiece {
  NumberBlock points;
  TextRange points_type;  // "float", "Float64"
  // Of unstructured grids; empty where the file has none.
  std::optional<NumberBlock> connectivity;
  std::optional<NumberBlock> offsets;  // none: counts stand in the connectivity
  std::optional<NumberBlock> types;
  // Faces of polyhedra as VTK 9.4 and later write them, which VTK 9.1 does not read.
  std::vector<NumberBlock> faces;
  std::size_t node_count = 0;
  std::size_t cell_count = 0;
};

/// A number that counts bytes from the start of the appended data.
struct AppendedOffset {
  TextRange text;
  std::size_t value;
};

/// How a VTK file is made: what its writer is told, and where the numbers stand that change.
struct VtkLayout {
  std::vector<VtkPiece> pieces;
  std::string type_name;  // "UNSTRUCTURED_GRID", "PolyData"
  // Legacy.
  std::string version;  // the first line
  std::string title;
  int major_version = 0;
  bool binary = false;
  /// Where VTK's reader cannot read some numbers: the text with others in their place.
  std::optional<std::string> readable;
  // XML.
  bool big_endian = false;
  std::size_t header_bytes = 4;
  NumberBlock::Compressor compressor = NumberBlock::Compressor::none;
  bool appended = false;
  bool raw = false;  // of appended data
  std::size_t appended_begin = 0;
  std::vector<AppendedOffset> offsets;
  /// Whether `agrees` has found that all is where the layout says.
  bool in_place = false;

  [[nodiscard]] std::size_t node_count() const;
  [[nodiscard]] std::size_t cell_count() const;
};

/// In `VtkLayout::readable`, for numbers that the streams of C++ do not read. Exact in float32; no
/// mesh has them.
inline constexpr double kInsteadOfNan = -0x1.a5c3f2p+125;
inline constexpr double kInsteadOfInfinity = 0x1.d3a196p+124;
inline constexpr double kInsteadOfMinusInfinity = -0x1.d3a196p+124;

/// Of a ".vtk" file. Throws FORMAT_ERROR, FILE_TRUNCATED with the line, ELEMENT_NOT_SUPPORTED for
/// data sets that are structured. O(file).
[[nodiscard]] VtkLayout scan_legacy(const std::filesystem::path& path, std::string_view file);

/// Of a ".vtu" or ".vtp" file. Throws FORMAT_ERROR, FILE_TRUNCATED. O(file).
[[nodiscard]] VtkLayout scan_xml(const std::filesystem::path& path, std::string_view file);

/// None: VTK has another name for it, or no such type.
[[nodiscard]] std::optional<NumberType> legacy_number_type(std::string_view lower_case_name);
[[nodiscard]] std::optional<NumberType> xml_number_type(std::string_view name);

}  // namespace meshsmooth::formats

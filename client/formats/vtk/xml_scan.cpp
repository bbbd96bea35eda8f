#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <utility>

#include "readers.hpp"
#include "text.hpp"
#include "vtk/layout.hpp"
#include "vtk/xml_tags.hpp"

namespace meshsmooth::formats {
namespace {

using Kind = NumberType::Kind;

/// Walks over a ".vtu" or ".vtp" file up to its appended data, which are not XML.
class XmlScan {
 public:
  XmlScan(const std::filesystem::path& path, std::string_view file)
      : path_(path), file_(file), tags_(path, file) {}

  VtkLayout scan() {
    while (const auto tag = tags_.next()) {
      if (tag->opens) open(*tag);
      if (tag->closes) close(*tag);
      if (layout_.appended) break;
    }
    if (layout_.type_name.empty()) fail("FORMAT_ERROR", path_, "this is no VTK XML file");
    if (!layout_.appended && !elements_.empty()) {
      fail("FILE_TRUNCATED", path_, "there is no </" + std::string(elements_.back()) + ">");
    }
    for (VtkPiece& piece : layout_.pieces) {
      finish(piece.points);
      for (auto* block : {&piece.connectivity, &piece.offsets, &piece.types}) {
        if (*block) finish(**block);
      }
      for (NumberBlock& block : piece.faces) finish(block);
    }
    return std::move(layout_);
  }

 private:
  void open(const XmlTag& tag) {
    if (tag.name == "VTKFile") open_file(tag);
    if (layout_.type_name.empty()) fail("FORMAT_ERROR", path_, "this is no VTK XML file");
    if (tag.name == "Piece") open_piece(tag);
    if (tag.name == "DataArray") open_array(tag);
    if (tag.name == "AppendedData") open_appended(tag);
    elements_.push_back(tag.name);
  }

  void close(const XmlTag& tag) {
    if (elements_.empty() || elements_.back() != tag.name) {
      tags_.refuse(
          "found </" + std::string(tag.name) + ">" +
          (elements_.empty() ? "" : ", expected </" + std::string(elements_.back()) + ">"));
    }
    elements_.pop_back();
  }

  void open_file(const XmlTag& tag) {
    using Compressor = NumberBlock::Compressor;
    static const std::map<std::string_view, Compressor> compressors = {
        {"vtkZLibDataCompressor", Compressor::zlib},
        {"vtkLZ4DataCompressor", Compressor::lz4},
        {"vtkLZMADataCompressor", Compressor::lzma}};
    layout_.type_name = tag["type"];
    layout_.big_endian = tag["byte_order"] == "BigEndian";
    layout_.header_bytes = tag["header_type"] == "UInt64" ? 8 : 4;
    if (const auto found = compressors.find(tag["compressor"]); found != compressors.end()) {
      layout_.compressor = found->second;
    }
    const bool surface = extension_of(path_) == ".vtp";
    if (layout_.type_name == (surface ? "PolyData" : "UnstructuredGrid")) return;
    const bool other = layout_.type_name == (surface ? "UnstructuredGrid" : "PolyData");
    fail(other ? "FORMAT_ERROR" : "ELEMENT_NOT_SUPPORTED", path_,
         "it holds " + (layout_.type_name.empty() ? "no type of data" : layout_.type_name) +
             (other ? std::string("; give it the extension ") + (surface ? ".vtu" : ".vtp")
                    : std::string("; only UnstructuredGrid (.vtu) and PolyData (.vtp) can be "
                                  "smoothed: convert it to an unstructured grid")));
  }

  std::size_t number(const XmlTag& tag, std::string_view name) const {
    const std::string_view word = trimmed(tag[name]);
    std::size_t value = 0;
    if (word.empty()) return 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      tags_.refuse(std::string(name) + "=\"" + std::string(tag[name]) + "\" is not a number");
    }
    return value;
  }

  void open_piece(const XmlTag& tag) {
    VtkPiece& piece = layout_.pieces.emplace_back();
    piece.node_count = number(tag, "NumberOfPoints");
    for (const char* name :
         {"NumberOfCells", "NumberOfVerts", "NumberOfLines", "NumberOfStrips", "NumberOfPolys"}) {
      piece.cell_count += number(tag, name);
    }
    piece.points.type = kFloat64;
    has_points_ = false;
  }

  void open_array(const XmlTag& tag) {
    if (!tag["offset"].empty()) {
      layout_.offsets.push_back({range_of(tag["offset"]), number(tag, "offset")});
    }
    if (layout_.pieces.empty() || elements_.empty()) return;
    VtkPiece& piece = layout_.pieces.back();
    if (elements_.back() == "Points" && !std::exchange(has_points_, true)) {
      piece.points = block_of(tag);
      piece.points.count = piece.node_count <= file_.size() * 8 ? 3 * piece.node_count : 0;
      piece.points_type = range_of(tag["type"]);
    }
    if (elements_.back() != "Cells") return;
    const std::string_view name = tag["Name"];
    if (name == "connectivity") piece.connectivity = block_of(tag);
    if (name == "offsets") piece.offsets = block_of(tag);
    if (name == "types") piece.types = block_of(tag);
    static constexpr auto kFaces = std::to_array<std::string_view>(
        {"face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets"});
    const auto face = std::ranges::find(kFaces, name);
    if (face == kFaces.end()) return;
    piece.faces.resize(kFaces.size());
    piece.faces[static_cast<std::size_t>(face - kFaces.begin())] = block_of(tag);
  }

  /// Of which only `finish` knows the place where it is appended.
  NumberBlock block_of(const XmlTag& tag) {
    NumberBlock block;
    const auto type = xml_number_type(tag["type"]);
    if (!type) {
      tags_.refuse("\"" + std::string(tag["type"]) + "\" is not a type of numbers of VTK");
    }
    block.type = *type;
    block.count = NumberBlock::kAll;
    if (!tag["offset"].empty()) {
      block.begin = number(tag, "offset");
      block.encoding = NumberBlock::Encoding::raw;
      return block;
    }
    constexpr std::string_view kBlanks = " \t\r\n";
    block.begin = std::min(file_.find_first_not_of(kBlanks, tag.end), file_.size());
    block.limit = std::min(file_.find('<', tag.end), file_.size());
    block.begin = std::min(block.begin, block.limit);
    if (tag["format"] == "binary") block.encoding = NumberBlock::Encoding::base64;
    return block;
  }

  void open_appended(const XmlTag& tag) {
    const std::size_t begin = file_.find_first_not_of(" \t\r\n", tag.end);
    if (begin == std::string_view::npos) fail("FILE_TRUNCATED", path_, "it has no appended data");
    layout_.appended = true;
    layout_.raw = tag["encoding"] == "raw";
    layout_.appended_begin = begin + (file_[begin] == '_' ? 1 : 0);
  }

  void finish(NumberBlock& block) const {
    block.big_endian = layout_.big_endian;
    if (block.encoding == NumberBlock::Encoding::ascii) return;
    block.header_bytes = layout_.header_bytes;
    block.compressor = layout_.compressor;
    if (block.encoding != NumberBlock::Encoding::raw) return;
    if (!layout_.raw) block.encoding = NumberBlock::Encoding::base64;
    block.limit = file_.size();
    block.begin = layout_.appended && block.begin < file_.size() - layout_.appended_begin
                      ? block.begin + layout_.appended_begin
                      : file_.size();
  }

  [[nodiscard]] TextRange range_of(std::string_view part) const {
    return {static_cast<std::size_t>(part.data() - file_.data()), part.size()};
  }

  const std::filesystem::path& path_;
  std::string_view file_;
  XmlTags tags_;
  VtkLayout layout_;
  std::vector<std::string_view> elements_;  // that are open
  bool has_points_ = false;
};

}  // namespace

std::optional<NumberType> xml_number_type(std::string_view name) {
  static const std::map<std::string_view, NumberType> types = {
      {"Int8", {Kind::integer, 1}},  {"UInt8", {Kind::natural, 1}},
      {"Int16", {Kind::integer, 2}}, {"UInt16", {Kind::natural, 2}},
      {"Int32", {Kind::integer, 4}}, {"UInt32", {Kind::natural, 4}},
      {"Int64", {Kind::integer, 8}}, {"UInt64", {Kind::natural, 8}},
      {"Float32", kFloat32},         {"Float64", kFloat64}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

VtkLayout scan_xml(const std::filesystem::path& path, std::string_view file) {
  return XmlScan(path, file).scan();
}

}  // namespace meshsmooth::formats

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "coordinate_fields.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

/// Lists of numbers, one after the other.
struct FoamFaces {
  std::vector<std::int64_t> first = {0};  // of each face in `nodes`, and the end
  std::vector<std::int64_t> nodes;

  [[nodiscard]] std::size_t size() const { return first.size() - 1; }
  [[nodiscard]] std::size_t node_count(std::size_t face) const {
    return static_cast<std::size_t>(first[face + 1] - first[face]);
  }
  [[nodiscard]] const std::int64_t* nodes_of(std::size_t face) const {
    return nodes.data() + first[face];
  }
};

/// One of the named dictionaries of `boundary` or a file of zones.
struct FoamEntry {
  std::string name;
  std::string type;
  std::int64_t face_count = 0;  // of a patch
  std::int64_t start_face = 0;
  std::string neighbour;             // the patch that a cyclic one has to match
  std::vector<std::string> groups;   // that a patch is in
  std::vector<std::int64_t> labels;  // of a zone
};

/// The file of a polyMesh folder, or the compressed one, `name` with ".gz", where there is only
/// that; OpenFOAM looks for them in this order.
[[nodiscard]] std::filesystem::path foam_file(const std::filesystem::path& folder,
                                              const std::string& name);

/// Reads a file of OpenFOAM's polyMesh: its header says whether its lists are text or bytes, and
/// how wide the numbers in them are.
class FoamReader {
 public:
  /// Throws FILE_NOT_FOUND, FORMAT_ERROR.
  explicit FoamReader(std::filesystem::path path);

  /// Where the coordinates stand; the nodes are numbered from 0.
  [[nodiscard]] CoordinateFields points();
  [[nodiscard]] FoamFaces faces();
  [[nodiscard]] std::vector<std::int64_t> labels();
  /// The dictionaries of `boundary`, `cellZones` and the like.
  [[nodiscard]] std::vector<FoamEntry> entries();
  /// Of a point, in bytes; 4 only in binary.
  [[nodiscard]] std::size_t scalar_width() const { return is_binary_ ? scalar_width_ : 8; }
  [[nodiscard]] std::string take_text() { return std::move(text_); }

 private:
  void read_header();
  void read_arch(std::string_view arch);
  [[nodiscard]] char peek();
  std::string_view token();
  void expect(std::string_view wanted);
  std::size_t count();
  std::int64_t label(std::string_view word) const { return scanner_.parse<std::int64_t>(word); }
  std::int64_t binary_label(std::string_view bytes) const;
  std::vector<std::int64_t> list(std::size_t count);
  void skip_value(std::string_view first);
  void skip_bytes_list();
  std::vector<std::string> words(std::string_view first);
  FoamEntry entry();

  std::filesystem::path path_;
  std::string text_;
  Scanner scanner_;
  bool is_binary_ = false;
  bool is_swapped_ = false;
  bool is_compact_ = false;  // faces as places and labels
  std::size_t label_width_ = 4;
  std::size_t scalar_width_ = 8;
};

}  // namespace meshsmooth::formats

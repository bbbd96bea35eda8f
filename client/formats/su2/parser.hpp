#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "content.hpp"
#include "notes.hpp"
#include "text.hpp"

namespace meshsmooth::formats {

/// Reads a mesh of SU2. Each zone numbers its nodes and elements from 0; here they are one mesh,
/// in which zones have no node in common.
class Su2Parser {
 public:
  /// `text` must outlive the parser.
  Su2Parser(std::filesystem::path file, std::string_view text);

  /// Throws FORMAT_ERROR, FILE_TRUNCATED, ELEMENT_NOT_SUPPORTED.
  void parse();
  /// All but the text and its fields.
  void store(FileContent& content);
  [[nodiscard]] CoordinateFields take_fields() { return std::move(fields_); }

 private:
  /// "NDIME= 2", in any of its spellings; the value as far as the next blank.
  struct Setting {
    std::string name;  // in capitals; empty: this line is none
    std::string_view value;
  };
  struct Zone {
    std::string number;  // as IZONE= has it; empty: there is none
    bool has_elements = false;
    bool has_points = false;
    bool has_marker_count = false;
    std::size_t marker_count = 0;
    std::size_t markers_found = 0;
    std::size_t first_node = 0;  // in the mesh
    std::size_t first_element = 0;
    std::size_t first_facet = 0;
  };

  static Setting parse_setting(std::string_view line);
  bool read(const Setting& setting);
  void set_dimension(std::string_view value);
  void find_dimension();
  void start_zone(std::string_view number);
  void finish_zone();
  std::size_t count(std::string_view value);
  void once(bool& has, std::string_view name) const;
  void read_points(std::size_t count);
  void read_elements(std::size_t count);
  void read_marker(std::size_t count);
  void read_cell(Cell& cell);
  std::string_view token();
  void check_nodes(std::vector<Cell>& cells, std::size_t first, const std::string& what) const;
  [[nodiscard]] std::string zone_prefix() const;

  std::filesystem::path file_;
  Scanner scanner_;
  int dimension_ = 0;
  std::size_t zone_count_ = 0;  // that NZONE announces; 0: nothing
  Zone zone_;
  std::string marker_;  // whose elements come next
  std::size_t marker_number_ = 0;
  CoordinateFields fields_;
  std::vector<Cell> elements_;
  std::vector<Cell> facets_;
  std::vector<double> facet_markers_;
  std::vector<std::size_t> element_zones_;  // from 0
  std::vector<std::size_t> facet_zones_;
  std::vector<std::string> zones_;                    // finished ones, by their numbers
  std::vector<std::pair<std::string, int>> markers_;  // and their numbers, from 1
  Notes notes_;
};

}  // namespace meshsmooth::formats

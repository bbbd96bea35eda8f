#include <algorithm>
#include <array>
#include <map>
#include <memory>

#include "cells.hpp"
#include "content.hpp"
#include "plane.hpp"
#include "readers.hpp"
#include "su2_writer.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

constexpr char kComment = '%';
constexpr std::string_view kHalo = "SEND_RECEIVE";  // of a partition: no boundary

/// "NDIME= 2", in any of its spellings; the value as far as the next blank.
struct Setting {
  std::string_view name;  // empty: this line is none
  std::string_view value;
};

Setting parse_setting(std::string_view line) {
  line = line.substr(0, line.find(kComment));
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return {};
  const std::string_view value = trimmed(line.substr(equals + 1));
  return {trimmed(line.substr(0, equals)), value.substr(0, value.find_first_of(" \t"))};
}

class Su2Parser {
 public:
  Su2Parser(path file, std::string_view text)
      : file_(std::move(file)), scanner_(file_, text, kComment) {}

  void parse() {
    bool in_unknown = false;
    while (!scanner_.at_end()) {
      const Setting setting = parse_setting(scanner_.peek_line());
      if (setting.name.empty()) {
        if (!in_unknown) scanner_.refuse("a keyword like NDIME=", scanner_.peek_line());
        scanner_.line();
        continue;
      }
      in_unknown = !read(setting);
    }
    if (!has_elements_) missing("NELEM");
    if (!has_points_) missing("NPOIN");
    if (marker_count_ != markers_found_) {
      fail("FILE_TRUNCATED", file_,
           "NMARK announces " + std::to_string(marker_count_) + " markers, there are " +
               std::to_string(markers_found_));
    }
  }

  void store(FileContent& content) {
    check_nodes();
    content.node_sets = std::move(sets_);
    auto dataset = std::make_shared<PlainDataset>();
    for (const auto* cells : {&elements_, &facets_}) {
      for (const Cell& cell : *cells) dataset->add_cell(cell.type, cell.nodes);
    }
    dataset->set_positions(fields_.positions);
    Column column{kSu2MarkerArray, true, std::vector<double>(elements_.size(), 0)};
    column.values.insert(column.values.end(), facet_markers_.begin(), facet_markers_.end());
    if (!facets_.empty()) dataset->add_cell_column(std::move(column));
    content.dataset = std::move(dataset);
  }
  [[nodiscard]] CoordinateFields take_fields() { return std::move(fields_); }

 private:
  /// False: a keyword that is not about the mesh; what follows is not read.
  bool read(const Setting& setting) {
    const auto& [name, value] = setting;
    if (name == "NDIME") {
      if (value != "2" && value != "3") scanner_.refuse("2 or 3 dimensions", value);
      dimension_ = value == "2" ? 2 : 3;
    } else if (name == "NZONE" && value != "1") {
      scanner_.refuse("one zone, in a file of its own", std::string(value) + " zones");
    } else if (name == "NELEM") {
      once(has_elements_, name);
      read_elements(count(value));
      return true;
    } else if (name == "NPOIN") {
      once(has_points_, name);
      read_points(count(value));
      return true;
    } else if (name == "NMARK") {
      marker_count_ = scanner_.parse<std::size_t>(value);
    } else if (name == "MARKER_TAG") {
      marker_ = value;
      if (marker_.empty()) scanner_.refuse("the name of a marker", value);
    } else if (name == "MARKER_ELEMS") {
      read_marker(count(value));
      return true;
    } else {
      scanner_.line();
      return name == "NZONE" || name == "IZONE" || name == "SEND_RECV";
    }
    scanner_.line();
    return true;
  }

  [[noreturn]] void missing(const std::string& name) const {
    fail("FILE_TRUNCATED", file_, "there is no " + name + "=");
  }
  void once(bool& has, std::string_view name) const {
    if (has) scanner_.refuse(std::string(name) + " once", "a second one");
    if (dimension_ == 0) scanner_.refuse("NDIME= first", name);
    has = true;
  }
  /// Also moves to the next line.
  std::size_t count(std::string_view value) {
    const auto number = scanner_.parse<std::size_t>(value);
    scanner_.line();
    return number;
  }

  void read_points(std::size_t count) {
    const auto dimension = static_cast<std::size_t>(dimension_);
    for (std::size_t point = 0; point < count; ++point) {
      std::array<CoordinateFields::Field, 3> found{};
      std::array<double, 3> values{};
      (void)scanner_.at_end();  // to the next line that is no comment
      for (std::size_t axis = 0; axis < dimension; ++axis) {
        const std::string_view word = token();
        values[axis] = scanner_.parse<double>(word);
        found[axis] = {scanner_.offset_of(word), word.size()};
      }
      scanner_.line();
      fields_.node_ids.push_back(static_cast<std::int64_t>(point));
      fields_.fields.push_back(found);
      fields_.positions.push_back({values[0], values[1], values[2]});
    }
  }

  /// "VTK-type node node … [number]".
  void read_cell(Cell& cell) {
    (void)scanner_.at_end();
    const std::string_view word = token();
    cell.type = scanner_.parse<int>(word);
    const CellKind* kind = find_vtk_cell(cell.type);
    if (kind == nullptr || is_second_order(*kind)) {
      fail("ELEMENT_NOT_SUPPORTED", file_,
           "element " + std::to_string(elements_.size()) + " is of the type " +
               PlainDataset().cell_name(cell.type) +
               "; only linear triangles, quads, tetrahedra, pyramids, wedges and hexahedra can be "
               "smoothed");
    }
    cell.nodes.clear();
    for (int corner = 0; corner < kind->node_count; ++corner) {
      cell.nodes.push_back(scanner_.parse<std::int64_t>(token()));
    }
    scanner_.line();
  }
  /// The next one of this line.
  std::string_view token() {
    const std::string_view word = scanner_.token_on_line();
    if (word.empty() && scanner_.at_end()) scanner_.truncated();
    if (word.empty()) scanner_.refuse("more numbers in the line before", word);
    if (word.find('=') != std::string_view::npos) scanner_.refuse("a number", word);
    return word;
  }

  void read_elements(std::size_t count) {
    Cell cell;
    for (std::size_t element = 0; element < count; ++element) {
      read_cell(cell);
      elements_.push_back(cell);
    }
  }

  void read_marker(std::size_t count) {
    if (marker_.empty()) scanner_.refuse("MARKER_TAG= before MARKER_ELEMS=", "");
    ++markers_found_;
    const bool halo = marker_ == kHalo;
    if (halo && !parse_setting(scanner_.peek_line()).name.empty()) scanner_.line();  // SEND_TO=
    NodeSet set{marker_, {}};
    Cell cell;
    for (std::size_t facet = 0; facet < count; ++facet) {
      read_cell(cell);
      if (halo) continue;
      for (const std::int64_t node : cell.nodes) {
        if (node < 0 || node != static_cast<NodeId>(node)) {
          scanner_.refuse("the number of a node", std::to_string(node));
        }
        set.nodes.push_back(static_cast<NodeId>(node));
      }
      facets_.push_back(cell);
      facet_markers_.push_back(static_cast<double>(markers_found_));
    }
    if (!halo) sets_.push_back(std::move(set));
    marker_.clear();
  }

  void check_nodes() const {
    const auto node_count = static_cast<std::int64_t>(fields_.positions.size());
    const auto check = [&](const std::vector<Cell>& cells, const std::string& what) {
      for (std::size_t index = 0; index < cells.size(); ++index) {
        for (const std::int64_t node : cells[index].nodes) {
          if (node >= 0 && node < node_count) continue;
          fail("FORMAT_ERROR", file_,
               what + " " + std::to_string(index) + " uses node " + std::to_string(node) +
                   ", there are only " + std::to_string(node_count));
        }
      }
    };
    check(elements_, "element");
    check(facets_, "element of a marker");
  }

  path file_;
  Scanner scanner_;
  int dimension_ = 0;
  bool has_elements_ = false;
  bool has_points_ = false;
  std::size_t marker_count_ = 0;
  std::size_t markers_found_ = 0;
  std::string marker_;  // whose elements come next
  CoordinateFields fields_;
  std::vector<Cell> elements_;
  std::vector<Cell> facets_;
  std::vector<double> facet_markers_;
  std::vector<NodeSet> sets_;
};

}  // namespace

MeshFile read_su2(const path& file) {
  FileContent content;
  content.extension = ".su2";
  std::string text = read_bytes(file);
  if (text.find('\0') != std::string::npos) fail("FORMAT_ERROR", file, "this is no text");
  Su2Parser parser(file, text);
  parser.parse();
  parser.store(content);
  CoordinateFields fields = parser.take_fields();
  content.segments.push_back(whole_file(std::move(text), std::move(fields)));
  return make_mesh_file(file, std::move(content));
}

void write_su2(const path& file, const MeshFile& mesh_file) {
  const auto& content = mesh_file.content();
  if (!content || content->extension != ".su2") {
    write_bytes(file, make_su2(file, mesh_file));
    return;
  }
  const TextSegment& segment = content->segments.front();
  if (segment.fields.fields.front()[2].length == 0) check_plane(file, mesh_file.mesh);
  write_bytes(file, replace_coordinates(segment, mesh_file.mesh));
}

}  // namespace meshsmooth::formats
